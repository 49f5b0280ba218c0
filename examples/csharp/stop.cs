// A test in C# with the controller in the same process: STOP is pressed in the middle of a move, and the
// software under test has to notice. Here the software is three lines; yours opens vimc4_port() or
// vimc4_tcp(), or reads and writes the line as this does.

using System;
using System.Runtime.InteropServices;
using System.Text;

static class Stop
{
    const string Library = "vimc4_c";

    [DllImport(Library)] static extern IntPtr vimc4_last_error();
    [DllImport(Library)] static extern void vimc4_free(IntPtr text);
    // The last option is null.
    [DllImport(Library)] static extern IntPtr vimc4_start(string[] options);
    [DllImport(Library)] static extern void vimc4_stop(IntPtr emulator);
    [DllImport(Library)] static extern long vimc4_run_until(IntPtr emulator, string condition);
    [DllImport(Library)] static extern IntPtr vimc4_order(IntPtr emulator, string order);
    [DllImport(Library)] static extern int vimc4_position(IntPtr emulator, long[] steps, UIntPtr count);
    [DllImport(Library)] static extern IntPtr vimc4_connect(IntPtr emulator);
    [DllImport(Library)] static extern void vimc4_line_close(IntPtr line);
    [DllImport(Library)]
    static extern IntPtr vimc4_line_read(IntPtr line, byte[] bytes, UIntPtr count, uint milliseconds);
    [DllImport(Library)]
    static extern IntPtr vimc4_line_write(IntPtr line, byte[] bytes, UIntPtr count, uint milliseconds);

    static void Holds(bool so, string what)
    {
        if (!so)
            throw new Exception(what + ": " + Marshal.PtrToStringAnsi(vimc4_last_error()));
    }

    static void Main()
    {
        IntPtr emulator = vimc4_start(new[] { "model=imc4", "time=manual", null });
        Holds(emulator != IntPtr.Zero, "cannot start");
        IntPtr line = vimc4_connect(emulator);
        byte[] commands = Encoding.ASCII.GetBytes("@01\r@0A5000,900\r");
        long sent = (long)vimc4_line_write(line, commands, (UIntPtr)commands.Length, 1000);
        Holds(sent == commands.Length, "cannot send");

        // Time stands still but for what is asked for here, so this is step 2,500 exactly.
        Holds(vimc4_run_until(emulator, "x = 2500") >= 0, "it does not get there");
        vimc4_free(vimc4_order(emulator, "press stop"));
        Holds(vimc4_run_until(emulator, "idle") >= 0, "it does not stop");

        byte[] answer = new byte[1];
        string answers = "";
        for (int i = 0; i < 2; i++)
        {
            Holds((long)vimc4_line_read(line, answer, (UIntPtr)1, 1000) == 1, "no answer");
            answers += (char)answer[0];
        }
        long[] steps = new long[1];
        Holds(vimc4_position(emulator, steps, (UIntPtr)1) > 0, "no position");
        Console.WriteLine("answers {0} at step {1}", answers, steps[0]);

        vimc4_line_close(line);
        vimc4_stop(emulator);
    }
}
