"""The commands, a module a subject: functions whose arguments are the words of the command line.

What takes Warp or USD is imported inside of them, so that help is quick.
"""
