"""The commands of the program; they are few lines each around what a user could call from Python."""
