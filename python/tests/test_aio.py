"""Tasks instead of threads."""

import asyncio
import threading

import pytest
import vimc4 as virtual

MOVE = b"@0A5000,900,0,900,0,900,0,900\r"


def in_a_loop(main):
    """Runs a test in a loop of asyncio, a minute at most."""

    async def limited(*arguments):
        await asyncio.wait_for(main(*arguments), 60)

    def test(*arguments):
        asyncio.run(limited(*arguments))

    test.__name__ = main.__name__
    return test


def emulator():
    return virtual.Emulator(time="manual")


@in_a_loop
async def test_nobody_who_awaits_stops_the_loop():
    with virtual.Emulator(time="real") as emulator:
        ticks = 0

        async def tick():
            nonlocal ticks
            while True:
                await asyncio.sleep(0)
                ticks += 1

        ticking = asyncio.create_task(tick())
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(emulator.aio.until_paused(), 0.1)
        assert ticks > 10
        ticking.cancel()


@in_a_loop
async def test_many_await_at_once():
    with emulator() as one, emulator() as other:
        waiting = [asyncio.ensure_future(e.aio.until_paused()) for e in (one, other) * 100]
        await asyncio.sleep(0)
        assert not any(task.done() for task in waiting)
        await one.aio.pause()
        await other.aio.pause()
        assert {pause.at for pause in await asyncio.gather(*waiting)} == {0}


@in_a_loop
async def test_a_cancelled_task_gives_its_way_through_time_up():
    with virtual.Emulator(time="real") as emulator:
        reader, writer = await emulator.aio.connect()
        writer.write(b"@07\r" + MOVE)
        await reader.readexactly(1)
        journey = emulator.aio.run_until("x = 5000")
        task = asyncio.ensure_future(journey)
        await asyncio.sleep(0.01)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        with pytest.raises(virtual.Cancelled) as cancelled:
            journey.wait(60)
        assert cancelled.value.at < 5_600_000_000
        writer.close()


@in_a_loop
async def test_time_on_its_way_is_watched_and_held_up():
    with emulator() as e:
        reader, writer = await e.aio.connect()
        # A program that never ends: there is always more of it to go through.
        for line in (b"@01", b"@0i", b"0100,900", b"0-100,900", b"30,-2", b"9"):
            writer.write(line + b"\r")
            assert await reader.readexactly(1) == b"0", line
        await e.aio.press("start")
        journey = e.aio.advance("100000h")
        while journey.progress.now == 0:
            await asyncio.sleep(0.001)
        journey.pause()
        while not journey.progress.paused:
            await asyncio.sleep(0.001)
        before = journey.progress.now
        journey.resume()
        while journey.progress.now == before:
            await asyncio.sleep(0.001)
        journey.cancel()
        with pytest.raises(virtual.Cancelled):
            await journey
        writer.close()


@in_a_loop
async def test_an_answer_may_be_awaited_twice():
    with emulator() as e:
        now = e.aio.now()
        assert await now == await now == now.wait() == 0
        wrong = e.aio.press("doorbell")
        for _ in range(2):
            with pytest.raises(virtual.DeedError, match="doorbell"):
                await wrong


@in_a_loop
async def test_reports_come_as_they_happen():
    with emulator() as e:
        reports = e.aio.reports("command", "answer")
        seen = []

        async def watch():
            async for report in reports:
                event = report["what"].get("event")
                if event:
                    seen.append(event["event"]["event"])

        watching = asyncio.create_task(watch())
        await asyncio.sleep(0)
        reader, writer = await e.aio.connect()
        writer.write(b"@07\r")
        assert await reader.readexactly(1) == b"0"
        writer.close()
        await writer.wait_closed()
        while len(seen) < 2:
            await asyncio.sleep(0.001)
        assert seen == ["command", "answer"]
        e.close()
        await watching


@in_a_loop
async def test_streams_end_with_the_emulator():
    with emulator() as e:
        reader, writer = await e.aio.connect()
        writer.write(b"@07\r")
        assert await reader.read(10) == b"0"
        e.close()
        assert await reader.read() == b""
        assert writer.is_closing()
        await writer.wait_closed()


@in_a_loop
async def test_more_than_the_line_holds_is_written_bit_by_bit():
    with virtual.Emulator(time="manual") as e:
        reader, writer = await e.aio.connect()
        await e.aio.pause()
        # More than the megabyte that may wait on the line.
        writer.write(b"@" * 3_000_000)
        draining = asyncio.create_task(writer.drain())
        await asyncio.sleep(0.05)
        assert not draining.done()
        await e.aio.resume()
        await draining
        writer.close()


@in_a_loop
async def test_a_writer_that_is_aborted_leaves_the_rest():
    with virtual.Emulator(time="manual") as e:
        reader, writer = await e.aio.connect()
        await e.aio.pause()
        writer.write(b"@" * 3_000_000)
        writer.transport.abort()
        await writer.wait_closed()
        assert writer.transport.get_write_buffer_size() == 0


def test_each_loop_has_its_own_bell():
    with emulator() as e:

        async def main():
            waiting = asyncio.ensure_future(e.aio.until_paused())
            await asyncio.sleep(0.01)
            return await waiting

        results = []
        threads = [threading.Thread(target=lambda: results.append(asyncio.run(main()))) for _ in range(4)]
        for thread in threads:
            thread.start()
        e.pause()
        for thread in threads:
            thread.join(60)
        assert [pause.at for pause in results] == [0] * 4
