// A host program in .NET. Arguments: a port or a TCP address, and `lines` if it also sets and
// reads the modem lines.
using System;
using System.IO;
using System.IO.Ports;
using System.Net.Sockets;
using System.Text;
using System.Threading;

static class Client {
    static Stream stream;

    static string Ask(string line, int count) {
        byte[] bytes = Encoding.GetEncoding("iso-8859-1").GetBytes(line);
        stream.Write(bytes, 0, bytes.Length);
        var answer = new StringBuilder();
        while (answer.Length < count) {
            int next = stream.ReadByte();
            if (next < 0) throw new EndOfStreamException(line);
            answer.Append((char)next);
        }
        return answer.ToString();
    }

    static void Main(string[] arguments) {
        SerialPort port = null;
        string[] address = arguments[0].Split(':');
        if (address.Length == 2) {
            stream = new TcpClient(address[0], int.Parse(address[1])).GetStream();
        } else {
            port = new SerialPort(arguments[0], 19200, Parity.None, 8, StopBits.One);
            port.ReadTimeout = 5000;
            port.Open();
            stream = port.BaseStream;
        }
        Console.Write(Ask("@01\r", 1));
        Ask("@0A20000,10000\r", 0);
        Thread.Sleep(300);
        Console.Write(Ask("\u00fd", 1));
        Console.Write(Ask("@0S\r", 1));
        Console.WriteLine(Ask("@0P\r", 19));
        if (arguments.Length > 1) {
            port.DtrEnable = false;
            port.RtsEnable = true;
            Console.WriteLine("CTS {0} DSR {1} DCD {2}", port.CtsHolding ? 1 : 0,
                port.DsrHolding ? 1 : 0, port.CDHolding ? 1 : 0);
        }
        stream.Close();
    }
}
