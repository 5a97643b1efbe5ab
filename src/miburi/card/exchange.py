"""The exchange with a card: a request is sent up to three times until the card answers it.

An :class:`Exchange` takes a request and returns the card's answer, or raises an error that says
what is wrong. Reports arrive at any time and are passed on as they come. Times are in s on the
line's clock.
"""

from collections.abc import Callable

from miburi.card.answers import NoAnswerError, read_answer
from miburi.card.line import Line
from miburi.card.link import ANSWER, Frame, FrameError, FrameKind, Receiver, Report, Result, encode
from miburi.card.settings import CardSettings

#: A request is sent at most this many times.
_TRIES = 3


class Exchange:
    """Requests and answers over one line, which can be replaced.

    ``open_line`` opens the line, or raises OSError; ``take`` is called with each report.

    Attributes
    ----------
    asked
        When the latest request was sent, in s.
    broken
        Whether a request met a broken line, which must be opened again.
    """

    def __init__(self, open_line: Callable[[], Line], take: Callable[[Report], None]) -> None:
        self._open, self._take = open_line, take
        self._line = open_line()
        self._receiver = Receiver()
        self._answers: list[Frame] = []
        self._sequence = 0
        self.asked = self.now()
        self.broken = False

    def now(self) -> float:
        """Return the time in s."""
        return self._line.now()

    def wait(self, until: float) -> None:
        """Wait until the time ``until``, in s, even on a broken line."""
        self._line.wait(until)

    def start_again(self) -> None:
        """Forget a frame that was cut off."""
        self._receiver = Receiver()

    def reopen(self) -> None:
        """Open the line again, if that is possible."""
        try:
            self._line.close()  # first: a device that is held open gets another name
            self._line = self._open()
            self.broken = False
        except OSError:
            self.broken = True

    def close(self) -> None:
        """Close the line."""
        self._line.close()

    def send(self, kind: FrameKind) -> None:
        """Send a request without waiting for the answer; may raise OSError.

        Any thread may call this while another one is in :meth:`ask`.
        """
        self._line.write(encode(Frame(kind, 0)))  # ask() never uses the number 0

    def ask(
        self, kind: FrameKind, payload: bytes, patience: float, settings: CardSettings
    ) -> bytes:
        """Send a request, at most three times; return what the card answers.

        ``patience`` is how long to wait for an answer each time, in s. If the card refuses, the
        message quotes ``settings``.

        Raises
        ------
        NoAnswerError
            No answer came, or the line is broken.
        BodyError
            The card refused; the message says why.
        """
        self._sequence = self._sequence % 255 + 1
        data = encode(Frame(kind, self._sequence, payload))
        self.asked = self.now()
        for _ in range(_TRIES):
            self._answers.clear()
            try:
                self._line.write(data)
                until = self.now() + patience
                while self.now() < until:
                    self.listen(until)
                    for answer in self._answers:
                        if answer.kind == kind + ANSWER and answer.sequence == self._sequence:
                            return read_answer(kind, answer, settings)
                        refused = answer.kind == FrameKind.REFUSED + ANSWER
                        if refused and answer.payload[:1] == bytes((Result.VERSION,)):
                            return read_answer(kind, answer, settings)
                    self._answers.clear()
            except OSError as error:
                self.broken = True
                raise NoAnswerError(f"The line to the card is broken: {error}.") from error
        raise NoAnswerError(
            "The card does not answer. Check cable and power, and that it has Miburi's firmware "
            "(miburi card upload)."
        )

    def listen(self, until: float) -> None:
        """Read what the card sends next: keep answers, pass reports on. May raise OSError."""
        for frame in self._receiver.add(self._line.read(until)):
            if frame.kind != FrameKind.REPORT:
                self._answers.append(frame)
                continue
            try:
                report = Report.of(frame.payload)
            except FrameError:
                continue
            self._take(report)
