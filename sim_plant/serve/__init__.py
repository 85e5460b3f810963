"""The simulated device at its connectors: serial frames on a pty, Modbus over TCP or a pty."""
