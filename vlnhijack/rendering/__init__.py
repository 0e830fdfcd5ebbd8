"""Rendering with Mitsuba 3 and the frozen sparse operator; the only place that imports Mitsuba."""
