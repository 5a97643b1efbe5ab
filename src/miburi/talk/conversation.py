"""Conversation via a language model, which runs on a server: the endpoint.

A remark and the partner's state go to the endpoint; a short text and a feeling with a strength come
back. If the endpoint is slow, fails or sends nonsense, the partner uses its own answers. The words
are only spoken, and the feeling is a stimulus among others: no reply can move or stop a body.

A new remark replaces the request for the previous one. A slow request stays open for a while: the
server may be loading its model, which closing the request would interrupt. Only the last few
exchanges are kept, and only in memory.
"""

import asyncio
import json
from collections import deque
from collections.abc import Iterable
from typing import Any

import httpx
from pydantic import BaseModel, Field, ValidationError

from miburi.feelings import FEELINGS, Stimulus
from miburi.live.state import State
from miburi.talk.care import may_be_said
from miburi.talk.endpoint import KEY, Endpoint, OvertakenError
from miburi.talk.replies import Content, read_reply
from miburi.version import __version__

#: After this time, in s, the partner uses its own answer. It is shorter than the 10 s for which
#: Miburi's client waits.
PATIENCE = 8.0
#: The largest answer of an endpoint, in bytes.
LARGEST_REPLY = 65_536

#: How long a slow request stays open, in s: as long as a model may take to load (our choice).
_LOADING = 120.0
#: How long connecting to the server may take, in s.
_CONNECTING = 3.0
#: How many exchanges are sent, the present remark included.
_REMEMBERED = 6
#: Tokens that the endpoint may spend, thoughts included.
_TOKENS = 1000
_NONE = "none"

_PROMPT = f"""\
You are Miburi, a small robot partner with a waist, a head and two arms, at a table with a person. \
Your body shows by gestures what you feel. It does so by itself: nothing that you say moves it or \
stops it, so promise no movement. Answer the person kindly and simply, in the person's language, \
in one or two short sentences, without emojis and markup. Write one JSON object and nothing else: \
{{"reply": "...", "feeling": "...", "strength": 0.5}}. reply is what you say. feeling is what you \
feel at the person's words: {", ".join(FEELINGS)} or {_NONE}. strength is how strongly, from 0 to \
1."""

_FIELDS = {
    "reply": {"type": "string"},
    "feeling": {"type": "string", "enum": [*FEELINGS, _NONE]},
    "strength": {"type": "number"},
}
_SCHEMA = {
    "type": "object",
    "properties": _FIELDS,
    "required": [*_FIELDS],
    "additionalProperties": False,
}
_FORMAT = {
    "type": "json_schema",
    "json_schema": {"name": "reply", "strict": True, "schema": _SCHEMA},
}
#: The statuses of servers that do not accept a field of the request, such as the response format.
_UNKNOWN_WISH = (400, 422)
#: The most likely causes of a status.
_HINTS = {
    401: f"the server rejects the key in {KEY}",
    403: f"the server rejects the key in {KEY}",
    404: "the server does not know the model; look at --model, and at --talk's path",
}


class _Message(BaseModel):
    content: str


class _Choice(BaseModel):
    message: _Message


class _Completion(BaseModel):
    """The part of a chat completion that is used."""

    choices: list[_Choice] = Field(min_length=1)


class _SilentError(Exception):
    """Why there is no reply, in words."""


class Conversation:
    """A conversation with whoever speaks to the partner; it belongs to one event loop.

    Parameters
    ----------
    endpoint
        The model that is asked.
    patience
        The time after which a reply counts as late, in s.
    """

    def __init__(self, endpoint: Endpoint, patience: float = PATIENCE) -> None:
        self.endpoint = endpoint
        #: Why the latest sentence got no reply; None if it got one.
        self.trouble: str | None = None
        self._patience = patience
        self._said: deque[tuple[str, str | None]] = deque(maxlen=_REMEMBERED)
        self._thinking: asyncio.Task[Content] | None = None
        self._slow: asyncio.Task[Content] | None = None
        self._plainly = False

    def forget(self) -> None:
        """Forget all exchanges."""
        self._said.clear()

    def overtake(self) -> None:
        """Drop the pending reply to an earlier remark."""
        if self._thinking is not None:
            self._thinking.cancel()

    async def reply(self, said: str, felt: Iterable[Stimulus], state: State) -> Content | None:
        """Return a reply, or None if no usable one came in time; then ``trouble`` says why.

        Raises OvertakenError if somebody has made another remark meanwhile.

        Parameters
        ----------
        felt
            The stimuli that the remark caused.
        state
            The partner's present state.
        """
        self.overtake()
        said = said.encode(errors="ignore").decode()  # half a character cannot be sent
        self._said.append((said, None))
        messages = [{"role": "system", "content": _prompt(felt, state)}, *self._messages()]
        task = self._thinking = asyncio.create_task(self._ask(messages))
        await asyncio.wait({task}, timeout=self._patience)
        if task.cancelled():
            raise OvertakenError("something else was said meanwhile.")
        self._thinking, self.trouble = None, self._trouble(task)
        if not task.done():
            self._leave_open(task)
        if self.trouble is not None:
            return None
        content = task.result()
        if not may_be_said(content.text):
            self.trouble = "a reply that it must not say."
            return None
        self._remember(said, content)
        return content

    def answered(self, answer: str) -> None:
        """Remember an answer of the partner's own, for the model's next request."""
        if self._said:
            self._remember(self._said[-1][0], Content(answer, None, 0.0))

    def _remember(self, said: str, content: Content) -> None:
        if self._said[-1] == (said, None):
            told = {
                "reply": content.text,
                "feeling": content.feeling or _NONE,
                "strength": content.strength,
            }
            self._said[-1] = (said, json.dumps(told, ensure_ascii=False))

    def _trouble(self, task: asyncio.Task[Content]) -> str | None:
        """Return why a request brought no reply; None if it brought one."""
        if not task.done():
            return f"no reply within {self._patience:g} s."
        match task.exception():
            case None:
                return None
            case _SilentError() as known:
                return str(known)
            case error:
                return f"no reply ({type(error).__name__})."

    def _messages(self) -> list[dict[str, str]]:
        """Return the latest exchanges; roles alternate, as some models' templates require."""
        messages: list[dict[str, str]] = []
        unanswered: list[str] = []
        for said, replied in self._said:
            unanswered.append(said)
            if replied is not None:
                messages.append({"role": "user", "content": "\n".join(unanswered)})
                messages.append({"role": "assistant", "content": replied})
                unanswered = []
        messages.append({"role": "user", "content": "\n".join(unanswered)})
        return messages

    def _leave_open(self, task: asyncio.Task[Content]) -> None:
        """Let one slow request go on, so that the server goes on loading; end any other."""
        if self._slow is None or self._slow.done():
            self._slow = task
            task.add_done_callback(lambda done: done.cancelled() or done.exception())
        else:
            task.cancel()

    async def _ask(self, messages: list[dict[str, str]]) -> Content:
        plain = {"model": self.endpoint.model, "messages": messages, "stream": False}
        wished = {**plain, "max_tokens": _TOKENS, "response_format": _FORMAT}
        async with asyncio.timeout(_LOADING):
            if not self._plainly:
                status, answer = await self._post(wished)
                if status not in _UNKNOWN_WISH:
                    return _content(status, answer)
            status, answer = await self._post(plain)
            self._plainly = status == httpx.codes.OK
            return _content(status, answer)

    async def _post(self, request: dict[str, Any]) -> tuple[int, bytes]:
        headers = {"Accept-Encoding": "identity", "User-Agent": f"miburi/{__version__}"}
        if self.endpoint.key is not None:
            headers["Authorization"] = f"Bearer {self.endpoint.key}"
        client = httpx.AsyncClient(
            verify=self.endpoint.tls,
            timeout=httpx.Timeout(_LOADING, connect=_CONNECTING),
            trust_env=False,  # else an environment proxy would get the words
            follow_redirects=False,
        )
        body, url = bytearray(), f"{self.endpoint.url}/chat/completions"
        async with client, client.stream("POST", url, json=request, headers=headers) as answer:
            async for part in answer.aiter_raw():
                body += part
                if len(body) > LARGEST_REPLY:
                    raise _SilentError(f"an answer larger than {LARGEST_REPLY} bytes.")
        return answer.status_code, bytes(body)


def _prompt(felt: Iterable[Stimulus], state: State) -> str:
    now = ["You feel nothing in particular now."]
    if state.felt is not None:
        now = [
            f"You feel {state.felt.feeling} now; your mood for it is {state.felt.mood:.2f} out "
            "of 1."
        ]
    if brought := ", ".join(f"{each.feeling} {each.strength:.2f}" for each in felt):
        now.append(f"The person's words have just made you feel {brought}.")
    moods = zip(FEELINGS, state.mood, strict=True)
    now.append(f"Your moods: {', '.join(f'{name} {mood:.2f}' for name, mood in moods)}.")
    if state.stop is not None:
        now.append("Your body has been stopped, and you do not mind.")
    return " ".join([_PROMPT, *now])


def _content(status: int, answer: bytes) -> Content:
    if httpx.codes.is_redirect(status):
        raise _SilentError("a redirect, which is not followed; give its address with --talk.")
    if status in _HINTS:
        raise _SilentError(f"an answer with status {status}: {_HINTS[status]}.")
    if status != httpx.codes.OK:
        raise _SilentError(f"an answer with status {status}.")
    try:
        text = _Completion.model_validate_json(answer).choices[0].message.content
    except ValidationError:
        raise _SilentError("no chat completion in the answer.") from None
    content = read_reply(text)
    if content is None:
        raise _SilentError("an answer without words.")
    return content
