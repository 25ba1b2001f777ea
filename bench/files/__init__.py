"""Files written by the user, of motors and stations, and their reading."""
