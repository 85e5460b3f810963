"""What travels between the processes and what is kept: messages, topics, bus, files, errors."""
