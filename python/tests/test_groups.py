"""Several controllers, and a simulation in Python, in one time."""

import copy

import pytest
import vimc4 as virtual


def test_the_mill_waits_until_the_feeder_has_fed():
    group = virtual.Group()
    feeder, mill = group.join("imc-s8"), group.join("imc-s8")
    # Output bit 3 of the feeder says "fed".
    group.wire((feeder, 0, 3), (mill, "input 0.3"))

    # The mill's program waits as long as bit 3 of its port 0 is 0, and then moves.
    group.send(mill, b"@01\r@0i\ro0,3,0,-1\r0400,400\r9\r")
    group.set(mill, "start", 1)
    group.set(mill, "start", 0)
    group.send(feeder, b"@01\r@0A800,400\r@0B0,8\r")

    # The feed takes two seconds. Meanwhile the mill has not moved.
    group.run_until(feeder, "x = 400")
    assert (group.position(feeder)[0], group.position(mill)[0]) == (400, 0)
    group.run_until_idle()
    assert (group.position(feeder)[0], group.position(mill)[0]) == (800, 400)


class Oven:
    """It is hot four seconds after its heater was switched on, and closes a contact then."""

    heater = hot_at = None

    def due(self):
        return self.hot_at

    def act(self, world):
        self.hot_at = None
        world.set(self.heater, "input 0.0", 1)

    def output(self, member, port, value, world):
        self.heater = member
        self.hot_at = world.now + 4_000_000_000 if value & 1 else None


def test_the_driver_waits_for_the_oven():
    group = virtual.Group(Oven())
    control = group.join("imc-s8")
    group.send(control, b"@01\r@0B0,1\r")
    heating, began = group.snapshot(), group.now
    assert group.run_until_idle() - began == 4_000_000_000
    group.send(control, b"@0b0\r")
    assert group.take_bytes(control) == b"00001"

    # Rolled back: what if the heater fails after three?
    group.restore(heating)
    group.advance("3s")
    group.send(control, b"@0B0,0\r")
    group.advance("60s")
    group.send(control, b"@0b0\r")
    assert group.take_bytes(control) == b"0000"


class Raises:
    """It goes wrong in one of its methods."""

    def __init__(self, where, does):
        self.where, self.does = where, does

    def due(self):
        return self.does() if self.where == "due" else 1_000 if self.where == "act" else None

    def act(self, world):
        if self.where == "act":
            self.does(world)

    def output(self, member, port, value, world):
        if self.where == "output":
            self.does(member, world)


def fails(*_):
    raise LookupError("broken")


@pytest.mark.parametrize("where", ["due", "act", "output"])
def test_what_a_simulation_raises_is_raised(where):
    group = virtual.Group(Raises(where, fails))
    with pytest.raises(LookupError, match="broken"):
        member = group.join("imc-s8")
        group.send(member, b"@01\r@0B0,1\r")
        group.advance("1s")


def test_a_simulation_that_is_wrong_is_told_so():
    with pytest.raises(TypeError, match="has no method `due`"):
        virtual.Group(object())
    for wrong, says in [
        (lambda member, world: world.set(member, "bell", 1), "no signal `bell`; there are .*input 0.0"),
        (lambda member, world: world.set(member, "start", 7), "`start` cannot be `7`; it can be 0 or 1"),
        (lambda member, world: world.output(member, 99), "no output port 99; there are 0"),
    ]:
        group = virtual.Group(Raises("output", wrong))
        member = group.join("imc-s8")
        with pytest.raises(virtual.DeedError, match=says):
            group.send(member, b"@01\r@0B0,1\r")
    for wrong, says in [(-5, ValueError), (2**64, ValueError), ("soon", TypeError), (0.5, TypeError)]:
        with pytest.raises(says, match=f"`due` of the simulation is .*not {wrong!r}"):
            virtual.Group(Raises("due", lambda: wrong)).advance("1s")
    group = virtual.Group(Raises("output", lambda member, world: group.position(member)))
    member = group.join("imc-s8")
    with pytest.raises(RuntimeError, match="the group is at work"):
        group.send(member, b"@01\r@0B0,1\r")


def test_a_simulation_sees_the_world():
    seen = []

    def see(member, world):
        seen.append((world.now, world.position(member), world.output(member, 0)))

    group = virtual.Group(Raises("output", see))
    member = group.join("imc-s8")
    group.send(member, b"@01\r@0B0,5\r")
    assert seen == [(0, group.position(member), 5)]


@pytest.mark.parametrize("fails", [False, True])
def test_a_world_is_over_when_its_simulation_has_returned(fails):
    class Keeps:
        world = None

        def due(self):
            return 1_000 if self.world is None else None

        def act(self, world):
            self.world = world
            world.set(member, "start", 1)
            if fails:
                raise LookupError

        def __deepcopy__(self, memo):
            return self

    keeps = Keeps()
    group = virtual.Group(keeps)
    member = group.join("imc4")
    if fails:
        with pytest.raises(LookupError):
            group.advance("1s")
    else:
        group.advance("1s")
    with pytest.raises(virtual.ControlError, match="this world is over"):
        keeps.world.set(member, "start", 0)
    # What it has seen is still to be read.
    assert keeps.world.now == 1_000


@pytest.mark.parametrize("where", ["due", "act"])
@pytest.mark.parametrize(
    "passes",
    [
        lambda group, _: group.advance("1s"),
        lambda group, _: group.run_until_idle(),
        lambda group, _: group.run_to(60_000_000_000),
        lambda group, member: group.run_until(member, "x = 9000"),
    ],
)
def test_time_stands_still_where_a_simulation_fails(where, passes):
    class Breaks:
        broken = False

        def due(self):
            if where == "due" and self.broken:
                fails()
            return 1_000_000_000 if self.broken else 500_000_000

        def act(self, world):
            self.broken = True
            if where == "act":
                fails()

    group = virtual.Group(Breaks())
    member = group.join("imc4", "mill")
    group.send(member, b"@07\r@0A9000,900,0,900,0,900,0,900\r")
    with pytest.raises(LookupError, match="broken"):
        passes(group, member)
    assert group.now == 500_000_000 and 440 < group.position(member)[0] <= 450


def test_a_simulation_that_is_always_due_is_told_so():
    class Insists:
        acts = 0

        def due(self):
            return 0

        def act(self, world):
            self.acts += 1

    group = virtual.Group(Insists())
    with pytest.raises(virtual.Endless, match="the simulation acts again and again"):
        group.advance("1s")
    assert group.now == 0 and group.simulation.acts == 1_000


@pytest.mark.parametrize("model, machine", [("imc4", "mill"), ("imc-s8", "bench"), ("smcu", "board-plotter")])
def test_the_state_of_another_group_is_refused(model, machine):
    group, other = virtual.Group(), virtual.Group(Oven())
    member = group.join("imc4", "mill")
    other.join(model, machine)
    other.advance("3s")
    for one, state in [(group, other.snapshot()), (other, group.snapshot())]:
        now, simulation = one.now, one.simulation
        with pytest.raises(virtual.ControlError, match="the state of another group"):
            one.restore(state)
        assert one.now == now and one.simulation is simulation
    # One of a copy is not one of another.
    later = group.copy()
    later.advance("1s")
    group.restore(later.snapshot())
    assert group.now == 1_000_000_000 and group.view(member)["model"] == "imc4"


def test_copies_go_their_own_way():
    group = virtual.Group(Oven())
    control = group.join("imc-s8", watching=["command"])
    group.send(control, b"@01\r@0B0,1\r")
    other = copy.copy(group)
    assert copy.deepcopy(control) == control and hash(control) == hash(copy.copy(control))
    other.run_until_idle()
    assert (group.now, other.now) == (0, 4_000_000_000)
    assert group.due == 4_000_000_000 and other.due is None
    assert group.simulation.hot_at == 4_000_000_000 and other.simulation.hot_at is None
    assert any(one.get("event") == "command" or "bytes" in one for one in group.drain(control))
    assert group.step() == 4_000_000_000 and group.step() is None
    assert group.view(control)["model"] and "Group of 1 at" in repr(group)


def test_mistakes_are_errors():
    group, another = virtual.Group(), virtual.Group()
    member = group.join("imc-s8")
    stranger = another.join("imc-s8")
    with pytest.raises(ValueError, match="another group"):
        group.send(stranger, b"@01\r")
    with pytest.raises(virtual.DeedError, match="no output port 9"):
        group.wire((member, 9, 0), (member, "input 0.0"))
    with pytest.raises(virtual.DeedError, match="no signal `bell`"):
        group.set(member, "bell", 1)
    with pytest.raises(virtual.DeedError, match="`start` cannot be `7`; it can be 0 or 1"):
        group.set(member, "start", 7)
    with pytest.raises(ValueError, match="no signal can be 1000000"):
        group.set(member, "start", 10**30)
    with pytest.raises(TypeError):
        group.set(member, "start", 0.5)
    with pytest.raises(ValueError, match="`-1s` is no time; write a number that is not negative"):
        group.advance("-1s")
    with pytest.raises(virtual.ConditionError):
        group.run_until(member, "x =")
    with pytest.raises(virtual.ProfileError):
        group.join("no-such-model")
    state = group.snapshot()
    later = group.copy().join("imc-s8")
    with pytest.raises(ValueError, match="another group"):
        group.position(later)
    group.join("imc-s8")
    with pytest.raises(virtual.ControlError, match=r"the state of a group of imc-s8 \(bench\), and here"):
        group.restore(state)
