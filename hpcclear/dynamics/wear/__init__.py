"""Wear over many revolutions: what worn surfaces come to, and one life from jump to jump."""
