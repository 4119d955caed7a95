"""Where surfaces of joints with clearance touch: one file a geometry of contact, one registry (`registry`)."""
