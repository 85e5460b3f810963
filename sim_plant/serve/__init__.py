"""The simulated device at its connectors: serial frames on a pty, Modbus over TCP and over a pty."""
