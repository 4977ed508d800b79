"""The cameras' clocks: from motion, time code, sound and light; lost pictures, read-outs of rolling shutters."""
