"""Tests of video sources."""
