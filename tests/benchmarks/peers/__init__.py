"""Other programs on the work of the cases, a file each. They are imported when they take part."""
