"""Waits grow with the load."""

import os

from patience import crowded


def test_a_quiet_machine_gets_twice_and_a_busy_one_more(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(os, "getloadavg", lambda: (0.1, 0.1, 90.0))
    assert crowded(5.0) == 10.0
    monkeypatch.setattr(os, "getloadavg", lambda: (3.0, 8.0, 0.0))
    assert crowded(5.0) == 40.0
