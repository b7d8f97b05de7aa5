"""
The door in front of the WebSocket of the bridge: pages of other web sites are turned away.

A browser lets any page that is open on this machine connect to its loopback, and says in `Origin`
whose page it is; the server of the Foxglove SDK does not look at it. So this listens in its place,
reads the head of the request, and hands the bytes of those that may come in through.
"""
import asyncio
from contextlib import suppress
import threading

HEAD_BYTES = 16_384       # of a request, at most
HEAD_S = 5.0              # in which it has to come
CLIENTS = 32              # at once
BLOCK_BYTES = 1 << 16
REFUSED = ('HTTP/1.1 403 Forbidden\r\nConnection: close\r\nContent-Type: text/plain\r\n'
           'Content-Length: {}\r\n\r\n{}')


def origin_of(head):
    """Return the origin in the head of an HTTP request (bytes), None where there is none."""
    found = [line.partition(b':')[2].strip().decode('latin1') for line in head.split(b'\r\n')[1:]
             if line.partition(b':')[0].strip().lower() == b'origin']
    if len(found) > 1:
        return ', '.join(found)       # of none that is allowed
    return found[0] if found else None


class FrontDoor:
    """
    Listen at host and port, and hand the bytes of allowed clients to the `inner` address.

    Parameters
    ----------
    host : str
    port : int
        0 for a free one.
    inner : tuple of str and int
        Where the server listens.
    allows : callable
        Whether an origin may come in; None is a program that is no browser.
    refuse : callable
        Called with the origin of each that is turned away, in a thread of its own.

    Raises
    ------
    OSError
        If the port cannot be opened.

    """

    def __init__(self, host, port, inner, allows, refuse):
        self._inner, self._allows, self._refuse, self._clients = inner, allows, refuse, 0
        self._loop = asyncio.new_event_loop()
        try:
            self._server = self._loop.run_until_complete(asyncio.start_server(
                self._come, host, port, limit=HEAD_BYTES))
        except OSError:
            self._loop.close()
            raise
        self.port = self._server.sockets[0].getsockname()[1]
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()

    def close(self):
        """Let nobody in any more, and those that are in go."""
        def end():
            self._server.close()
            for task in asyncio.all_tasks(self._loop):
                task.cancel()
            self._loop.call_later(0.1, self._loop.stop)
        self._loop.call_soon_threadsafe(end)
        self._thread.join(timeout=5.0)
        if not self._thread.is_alive():
            self._loop.close()

    async def _come(self, reader, writer):
        """Let one client in, or turn it away."""
        self._clients += 1
        try:
            with suppress(OSError, EOFError, asyncio.LimitOverrunError, asyncio.TimeoutError,
                          asyncio.CancelledError):
                head = await asyncio.wait_for(reader.readuntil(b'\r\n\r\n'), HEAD_S)
                origin = origin_of(head)
                if self._clients > CLIENTS:
                    await _answer(writer, f'{CLIENTS} clients are here already; close one')
                elif not self._allows(origin):
                    self._refuse(origin)
                    await _answer(writer, 'the page of this origin may not listen here; see the '
                                  'parameter origins of the bridge')
                else:
                    await self._pass(head, reader, writer)
        finally:
            self._clients -= 1
            writer.close()

    async def _pass(self, head, reader, writer):
        """Hand bytes through in both directions until one side ends."""
        theirs, ours = await asyncio.open_connection(*self._inner)
        try:
            ours.write(head)
            ways = [asyncio.ensure_future(_pump(a, b))
                    for a, b in ((reader, ours), (theirs, writer))]
            try:
                await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for way in ways:
                    way.cancel()
                await asyncio.gather(*ways, return_exceptions=True)
        finally:
            ours.close()


async def _pump(reader, writer):
    while data := await reader.read(BLOCK_BYTES):
        writer.write(data)
        await writer.drain()


async def _answer(writer, text):
    writer.write(REFUSED.format(len(text), text).encode())
    await writer.drain()
