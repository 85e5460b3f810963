"""Communication and storage: messages, topics, bus, session files, configuration, errors."""
