"""The workbench in a browser: how fast it shows and answers, and that nothing is lost."""
