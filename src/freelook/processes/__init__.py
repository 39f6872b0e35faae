"""Programs that run beside freelook, each in a process of its own, started by the sinks."""
