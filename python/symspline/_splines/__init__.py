"""Curves as users see them: classes of splines, their files, comparisons, and time laws."""
