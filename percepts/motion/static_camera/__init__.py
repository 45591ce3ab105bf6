"""static_camera."""
