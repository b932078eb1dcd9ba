"""The commands, by subject: functions whose arguments are the words of the command line."""
