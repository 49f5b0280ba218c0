port = open("vimc4.pty", "r+b", buffering=0)

def ask(line, digits=0):
    port.write(line.encode() + b"\r")
    answer = b""
    while len(answer) < 1 + digits:
        answer += port.read(1 + digits - len(answer))
    print(line, "->", answer.decode(), flush=True)

ask("@07")                                  # three axes
ask("@0R7")                                 # reference run: this is zero
ask("@0A40000,10000,0,900,0,900,0,900")     # 40,000 steps of X at 10,000 Hz: four seconds
ask("@0P", 18)                              # where are we?
ask("@0A-40000,2000,0,900,0,900,0,900")     # and back in twenty: press STOP now
ask("@0P", 18)                              # where STOP halted it
ask("@0S")                                  # the rest of the way
ask("@0P", 18)                              # at zero again
