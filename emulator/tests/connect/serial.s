# A conversation with a controller at COM1, as programs of the nineties held it: byte for byte
# through the registers of the 8250, or with --defsym BIOS=1 through the BIOS's INT 14h. A .COM
# program for DOS, or with --defsym BOOT=1 the boot sector of a computer without a system. What
# answers is written to the standard output (DOS) or port 0xE9 (boot sector); `?` means that
# nothing came for 5 s, `!` that a byte could not be sent.
        .code16
        .set    COM1, 0x3F8

        cli
        xor     %ax, %ax
.ifdef BOOT
        mov     %ax, %ds
        mov     %ax, %ss
        mov     $0x7C00, %sp
.endif
        sti
        cld
        xor     %dx, %dx                # 0 is COM1
        mov     $0xE3, %ax              # AH 0: set up; 9,600 baud, 8 bits, no parity, 1 stop bit
.ifdef BIOS
        int     $0x14
.else
        mov     $COM1 + 3, %dx
        mov     $0x80, %al              # the divisor is next
        out     %al, %dx
        mov     $COM1, %dx
        mov     $6, %ax                 # 115,200 / 6 = 19,200 baud
        out     %ax, %dx
        mov     $COM1 + 3, %dx
        mov     $0x03, %al              # 8 bits, no parity, 1 stop bit
        out     %al, %dx
        inc     %dx                     # DTR and RTS on
        out     %al, %dx
.endif

        mov     $steps, %si
step:   lodsb                           # ticks of the clock to wait
        cmp     $0xFF, %al
        je      end
        movzbw  %al, %cx
        call    wait
        lodsb                           # bytes to come
        movzbw  %al, %bp
1:      lodsb
        test    %al, %al
        jz      2f
        call    put
        jc      failed
        jmp     1b
2:      test    %bp, %bp
        jz      step
        call    get
        jc      silent
        call    show
        dec     %bp
        jmp     2b
failed: mov     $'!', %al
        jmp     3f
silent: mov     $'?', %al
3:      call    show
end:
.ifdef BOOT
        mov     $0xF4, %dx              # QEMU's isa-debug-exit
        out     %al, %dx
4:      hlt
        jmp     4b
.else
        mov     $0x4C00, %ax
        int     $0x21
.endif

# Waits for CX ticks, 55 ms each.
wait:   jcxz    1f
        call    ticks
        mov     %dx, %bx
2:      call    ticks
        sub     %bx, %dx
        cmp     %cx, %dx
        jb      2b
1:      ret

# The clock's ticks in DX.
ticks:  push    %cx
        xor     %ax, %ax
        int     $0x1A
        pop     %cx
        ret

# Shows AL.
show:
.ifdef BOOT
        out     %al, $0xE9
.else
        mov     %al, %dl
        mov     $0x02, %ah
        int     $0x21
.endif
        ret

# Sends AL; carry if that failed.
put:
.ifdef BIOS
        mov     $0x01, %ah
        xor     %dx, %dx
        int     $0x14
        shl     $1, %ah
.else
        mov     %al, %ah
        mov     $COM1 + 5, %dx
1:      in      %dx, %al
        test    $0x20, %al              # the transmitter is free
        jz      1b
        mov     $COM1, %dx
        mov     %ah, %al
        out     %al, %dx
        clc
.endif
        ret

# Receives AL; carry if nothing comes for 5 s.
get:    call    ticks
        mov     %dx, %bx
1:
.ifdef BIOS
        mov     $0x02, %ah
        xor     %dx, %dx
        int     $0x14
        shl     $1, %ah
        jnc     2f
.else
        mov     $COM1 + 5, %dx
        in      %dx, %al
        test    $0x01, %al              # a byte is there
        mov     $COM1, %dx
        jz      3f
        in      %dx, %al
        ret
3:
.endif
        call    ticks
        sub     %bx, %dx
        cmp     $91, %dx
        jb      1b
        stc
2:      ret

# Ticks to wait, bytes to come, what is sent.
steps:  .byte   0, 1
        .asciz  "@01\r"
        .byte   0, 0
        .asciz  "@0A20000,10000\r"
        .byte   4, 1
        .asciz  "\375"
        .byte   0, 1
        .asciz  "@0S\r"
        .byte   0, 19
        .asciz  "@0P\r"
        .byte   0xFF

.ifdef BOOT
        .org    510
        .word   0xAA55
.endif
