"""Rendering of the world as text, as a picture, in a window and as a video. All but text needs the extra ``render``."""

from predprey_env.rendering.ansi import text
from predprey_env.rendering.video import save_video

__all__ = ["save_video", "text"]
