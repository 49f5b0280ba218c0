"""All six lines with pyserial, and a command between."""
import sys
import serial

port = serial.Serial(sys.argv[1], 19200, timeout=10)
print("cts", port.cts, "dsr", port.dsr, "ri", port.ri, "cd", port.cd)
port.rts = False
port.dtr = False
print("cts", port.cts, "dsr", port.dsr, "ri", port.ri, "cd", port.cd)
port.rts = True
port.dtr = True
print("cts", port.cts, "dsr", port.dsr, "ri", port.ri, "cd", port.cd)
port.set_low_latency_mode(True)
port.write(b"@07\r")
print(port.read(1).decode())
