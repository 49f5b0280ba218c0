// A host program in Java, with what Java has. Argument: a terminal or a TCP address.
import java.io.*;
import java.net.Socket;
import java.nio.charset.StandardCharsets;

class Client {
    static InputStream in;
    static OutputStream out;

    static String ask(String line, int count) throws IOException {
        out.write(line.getBytes(StandardCharsets.ISO_8859_1));
        String answer = "";
        while (answer.length() < count) {
            int next = in.read();
            if (next < 0) throw new EOFException(line);
            answer += (char) next;
        }
        return answer;
    }

    public static void main(String[] arguments) throws Exception {
        String[] address = arguments[0].split(":");
        if (address.length == 2) {
            Socket socket = new Socket(address[0], Integer.parseInt(address[1]));
            in = socket.getInputStream();
            out = socket.getOutputStream();
        } else {
            in = new FileInputStream(arguments[0]);
            out = new FileOutputStream(arguments[0]);
        }
        System.out.print(ask("@01\r", 1));
        ask("@0A20000,10000\r", 0);
        Thread.sleep(300);
        System.out.print(ask("\u00fd", 1));
        System.out.print(ask("@0S\r", 1));
        System.out.println(ask("@0P\r", 19));
        out.close();
        in.close();
    }
}
