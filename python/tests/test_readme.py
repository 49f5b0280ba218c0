"""The test of the README."""

import pytest


@pytest.mark.vimc4(model="imc-s8", time="manual")
def test_stop_is_reported_with_where_it_halted(vimc4):
    port = vimc4.serial()
    port.write(b"@07\r@0A5000,300,0,900,0,900,0,900\r")
    vimc4.run_until("x = 2500")
    vimc4.press("stop")
    assert port.read(2) == b"0F"
    assert vimc4.position() == [2_500, 0, 0, 0]
