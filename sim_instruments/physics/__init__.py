"""Motor, circuit and shaft of the virtual bench, in closed form wherever one exists."""
