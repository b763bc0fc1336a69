"""Has what is measured event after event drifted from what its amplitude and temperature let expect?"""
