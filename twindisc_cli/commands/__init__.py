"""One module per subcommand: run(test) -> result."""
