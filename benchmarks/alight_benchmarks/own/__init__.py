"""What ``alight bench`` measures, section by section; nothing heavy is imported here."""
