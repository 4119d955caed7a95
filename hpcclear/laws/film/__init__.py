"""Oil films, one file each: Reynolds' equation, solved in some way."""
