"""What happens when: rules that a test begins."""

import asyncio
from pathlib import Path

import pytest
import vimc4 as virtual
from stepper import Stepper, StepperError

SLIPS = Path(__file__).parents[2] / "examples" / "scenario.toml"


def test_stop_is_pressed_on_the_way(vimc4):
    stepper = Stepper(vimc4.serial())
    with vimc4.scenario("rule once when x > 2500: press stop") as stops:
        with pytest.raises(StepperError, match="'F'"):
            stepper.move_by(5_000, 0, 0, speed=900)
        assert stops.acted == 1
    assert stepper.position()[0] < 5_000


@pytest.mark.vimc4(machine="mill", scenario=SLIPS)
def test_a_slip_is_found_by_the_next_reference_run(vimc4):
    stepper = Stepper(vimc4.serial())
    with pytest.raises(StepperError, match="'F'"):
        stepper.move_by(5_000, 0, 0, speed=900)
    assert [(rule.name, rule.acted) for rule in vimc4.rules()] == [("slips", 1), (None, 1)]


def test_a_scenario_ends_with_its_block_and_sets_back(vimc4):
    with vimc4.scenario("when command: power off") as blackout:
        vimc4.connect().write(b"@07\r")
        vimc4.run_until_idle()
        assert not vimc4.view()["powered"]
        assert [view.stage for view in blackout.rules()] == ["holds"]
    assert vimc4.view()["powered"] and vimc4.rules() == []
    # It is as it was at its end.
    assert blackout.acted == 1 and len(blackout.rules()) == 1


def test_rules_have_numbers_names_and_words(vimc4):
    one = vimc4.scenario("when y > 9: press start")
    two = vimc4.scenario("""
        rule slips once when x > 100: fault jam x for 20ms
        when rule slips then 500ms: press stop
    """)
    assert (one.number, two.number) == (1, 2)
    assert repr(two) == "<vimc4.Scenario 2>"
    assert vimc4.rules() == [
        (1, 1, None, "when y > 9: press start", "waits", 0),
        (2, 1, "slips", "rule slips once when x > 100: fault jam x for 20ms", "waits", 0),
        (2, 2, None, "when rule slips then 500ms: press stop", "waits", 0),
    ]
    assert len(two.rules()) == 2
    one.end()
    one.end()
    assert {view.scenario for view in vimc4.rules()} == {2}
    vimc4.order("rule end all")
    assert two.rules() == [] and two.acted == 0
    two.end()


def test_a_rule_may_wait_for_one_of_another_scenario(vimc4):
    waits = "when rule slips then 500ms: press stop"
    with vimc4.scenario("rule slips once when x > 100: fault jam x for 20ms"):
        assert vimc4.scenario(waits).acted == 0
    with pytest.raises(virtual.ScenarioError, match="no rule `slips`"):
        vimc4.scenario(waits)


def test_everything_is_reset(vimc4):
    vimc4.scenario("when y > 9: press start")
    fault = vimc4.fault("cut")
    vimc4.end_scenarios()
    assert vimc4.rules() == [] and len(vimc4.faults()) == 1
    vimc4.order("when x > 100: press stop")
    vimc4.reset()
    assert vimc4.rules() == [] and vimc4.faults() == [] and fault.is_over


def test_files_are_read_by_their_names(vimc4, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("stops.toml").write_text('[[rule]]\nwhen = "x > 100"\ndo = "press stop"\n')
    for name in ["stops.toml", Path("stops.toml")]:
        with vimc4.scenario(name) as stops:
            assert [view.rule for view in stops.rules()] == ["when x > 100: press stop"]


def test_a_scenario_in_its_own_words_is_also_an_option():
    with virtual.Emulator(time="instant", scenario="when command: press stop") as emulator:
        assert [view.rule for view in emulator.rules()] == ["when command: press stop"]
    with pytest.raises(virtual.ScenarioError, match="`when x >: press stop` is wrong"):
        virtual.Emulator(time="instant", scenario="when x >: press stop")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("", "there is no rule"),
        (" \n\n", "there is no rule"),
        ("press stop", "`press stop` is wrong"),
        ("at 2s: press start\n\nwhen x > far: press stop", "line 3: `when x > far.*is wrong at `far"),
        ("at 2s: press doorbell", "doorbell"),
        ("when rule nope: press stop", "`when rule nope: press stop` is wrong: there is no rule `nope`; write"),
        ("rule a at 2s: press start\n\nrule a at 3s: press stop", "line 3: .* there are two rules `a`"),
        ("rule a when rule b: press start\nrule b when rule a: press stop", "line 1: .* can never act"),
        ("no/such.toml", "cannot read the scenario no/such.toml"),
    ],
)
def test_errors_say_what_is_wrong(vimc4, words, says):
    with pytest.raises(virtual.ScenarioError, match=says):
        vimc4.scenario(words)
    assert issubclass(virtual.ScenarioError, ValueError)
    assert vimc4.rules() == []


def test_a_wrong_file_says_where(vimc4, tmp_path):
    wrong = tmp_path / "wrong.toml"
    wrong.write_text('[[rule]]\nwhen = "x > far"\ndo = "press stop"\n')
    with pytest.raises(virtual.ScenarioError, match="wrong.toml, line 2: .*is wrong at `far`"):
        vimc4.scenario(wrong)
    # What would be right is said once.
    wrong.write_text('[[rule]]\nwhen = "x > 5"\ndo = "cover shut"\n')
    with pytest.raises(virtual.ScenarioError) as raised:
        vimc4.scenario(wrong)
    assert str(raised.value).endswith("wrong at `shut`: `cover` cannot be `shut`; it can be open or closed")
    wrong.write_text("")
    with pytest.raises(virtual.ScenarioError, match="there is no rule"):
        vimc4.scenario(wrong)
    with pytest.raises(TypeError):
        vimc4.scenario(5)


def test_what_has_ended_has_no_scenarios():
    with virtual.Emulator(time="instant") as emulator:
        scenario = emulator.scenario("when y > 9: press start")
        emulator.stop()
        emulator.ended(timeout=60)
        scenario.end()
    assert scenario.acted == 0


def test_rules_can_be_awaited():
    async def asks():
        with virtual.Emulator(time="instant") as emulator:
            emulator.scenario("when y > 9: press start")
            emulator.fault("cut")
            rules = await emulator.aio.rules()
            assert (await emulator.aio.end_scenarios()).changed
            assert await emulator.aio.rules() == [] and len(await emulator.aio.faults()) == 1
            await emulator.aio.reset()
            return rules, await emulator.aio.faults()

    assert asyncio.run(asks()) == ([(1, 1, None, "when y > 9: press start", "waits", 0)], [])


def test_a_scenario_ends_with_its_test(pytester):
    pytester.makepyfile(
        """
        import pytest, vimc4

        @pytest.fixture(scope="module")
        def shared():
            with vimc4.Emulator(time="instant", scenario="at 9s: press start") as emulator:
                yield emulator

        def test_begins_one(shared):
            shared.scenario("when x > 1000: press stop")
            assert len(shared.rules()) == 2

        def test_fails(shared):
            assert [view.rule for view in shared.rules()] == ["at 9s: press start"]
            shared.scenario("when x > 1000: press stop")
            assert False

        def test_has_none(shared):
            assert [view.rule for view in shared.rules()] == ["at 9s: press start"]

        @pytest.fixture
        def after():
            rules = []
            yield rules
            assert rules[0].closed is False
            assert rules[0].rules() == []

        @pytest.mark.vimc4(scenario="when x > 1000: press stop")
        def test_marked(vimc4, after):
            assert len(vimc4.rules()) == 1
            after.append(vimc4)

        @pytest.mark.vimc4(scenario="when x >: press stop")
        def test_wrong(vimc4):
            pass
        """
    )
    result = pytester.runpytest("-p", "no:cacheprovider")
    result.assert_outcomes(passed=3, failed=1, errors=1)
    result.stdout.fnmatch_lines(["*ScenarioError: *is wrong*"])
