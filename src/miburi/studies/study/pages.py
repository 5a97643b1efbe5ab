"""The pages of a participant: information and consent, one question per page, and thanks.

They are plain HTML forms, which need no JavaScript: the only script lets a button start a film. The
participant's code is in a cookie, so a reload continues at the same page. An answer counts once,
and only for the next page of the participant whose code its form carries: two tabs, or Back, cannot
mix answers up.
"""

import hashlib
import logging
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, RedirectResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp

from miburi.errors import OutputError
from miburi.feelings import Expression
from miburi.ground.templates import render
from miburi.serving.allowance import Allowance
from miburi.studies.study.kept import AnswerPace, Participant
from miburi.studies.study.live import Ending, Perform, Turn, Turns
from miburi.studies.study.order import film_at, option_order
from miburi.studies.study.plan import NONE, SKIPPED, Film, Step, Study, pick
from miburi.studies.study.posted import LONGEST, Door, Form, make_code, posted, read_code, values_of
from miburi.studies.study.store import Store, StudyClosedError
from miburi.studies.study.texts import page_words, paragraphs, preferred

COOKIE = "miburi_study"
_LOG = logging.getLogger(__name__)
#: Follows the code in the cookie of a participant who has stopped.
_STOPPED = "-stopped"
_PAGES = Path(__file__).parent / "pages"
#: The limit on registrations and attempts to withdraw from one address: per second, and in a burst
#: (our choice).
_RATE, _BURST = 0.5, 60.0
_DAYS = 30
#: A participant who has not finished and requests no page for this time, in s, counts as gone, and
#: a newcomer may take that place in the order of films (our choice).
_GONE = 7200.0


def make_app(
    study: Study,
    store: Store,
    films: Mapping[str, Path],
    *,
    local: bool = True,
    perform: Perform | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> ASGIApp:
    """Return the application with a study's pages, at ``/study/NAME``.

    ``films`` are the files of all films, by name; ``perform`` has the robot in the room make a
    gesture, for a study with live gestures.

    If ``local``, only this computer may request pages, and requests must name a loopback host, such
    as ``localhost``: a website could make its own domain name point at this computer.

    ``clock`` returns the time in s; it times answers, and limits how fast newcomers may begin.
    """
    pages = _Pages(study, store, films, perform, clock)
    home = pages.home
    routes = [
        Route("/", lambda _: RedirectResponse(home)),
        Route(home, pages.welcome),
        Route(home, posted(pages.enter), methods=["POST"]),
        Route(f"{home}/page", pages.page),
        Route(f"{home}/page", posted(pages.answer), methods=["POST"]),
        Route(f"{home}/perform", posted(pages.perform), methods=["POST"]),
        Route(f"{home}/next", posted(pages.leave), methods=["POST"]),
        Route(f"{home}/stop", pages.ask_to_stop),
        Route(f"{home}/stop", posted(pages.stop), methods=["POST"]),
        Route(f"{home}/withdraw", pages.ask_to_withdraw),
        Route(f"{home}/withdraw", posted(pages.withdraw), methods=["POST"]),
        Route(f"{home}/information", pages.inform),
        Route(f"{home}/film/{{key}}", pages.film),
        Route(f"{home}/style.css", lambda _: FileResponse(_PAGES / "style.css")),
        Route(f"{home}/film.js", lambda _: FileResponse(_PAGES / "film.js")),
    ]
    app = Starlette(routes=routes, exception_handlers={OutputError: pages.refuse})
    return Door(app, local)


class _Pages:
    """The handlers of a study's pages."""

    def __init__(
        self,
        study: Study,
        store: Store,
        films: Mapping[str, Path],
        perform: Perform | None,
        clock: Callable[[], float],
    ) -> None:
        self.home = f"/study/{study.name}"
        self._study, self._store = study, store
        self._perform, self._turns, self._clock = perform, Turns(clock), clock
        self._allowance = Allowance(_RATE, _BURST, clock)
        # When a page was first shown, by participant number and step.
        self._shown: dict[tuple[int, int], float] = {}
        self._seen: dict[int, float] = {}  # when a participant last requested a question
        self._began = clock()
        # Functions that count the other gestures after a whole one, by participant and trial.
        self._others: dict[tuple[int, int], Callable[[], int]] = {}
        # A film's URL must not reveal its feeling.
        self._keys = {
            name: hashlib.sha256(f"{study.digest} {name}".encode()).hexdigest()[:20]
            for name in films
        }
        self._films = {self._keys[name]: path for name, path in films.items()}

    def welcome(self, request: Request) -> Response:
        """Show information and consent, or where a participant is."""
        if self._who(request) is not None:
            return RedirectResponse(f"{self.home}/page", 303)
        if (stopped := self._owner(request)) is not None:
            return self._show("stopped.html", stopped.language, code=_code(request))
        return self._show("welcome.html", self._language(request), again=False, missing=False)

    def inform(self, request: Request) -> Response:
        """Show the information again."""
        return self._show("welcome.html", self._language(request), again=True)

    def enter(self, request: Request, form: Form) -> Response:
        """Register a participant who consents; one who is registered, or has stopped, stays so."""
        if self._owner(request) is not None:
            return RedirectResponse(f"{self.home}/page", 303)
        language = self._language(request, form.get("language"))
        if form.get("agree") != "yes":
            return self._show("welcome.html", language, 422, again=False, missing=True)
        if not self._allowance.take(_asker(request)):
            return self._show("notice.html", language, 429, notice="busy")
        code = make_code()
        self._store.enter(code, language, self._gone())
        return self._remember(code, RedirectResponse(f"{self.home}/page", 303))

    def page(self, request: Request) -> Response:
        """Show the next question, or the page with thanks."""
        who = self._who(request)
        return RedirectResponse(self.home, 303) if who is None else self._ask(request, who)

    def answer(self, request: Request, form: Form) -> Response:
        """Store an answer, and go on."""
        who = self._who(request)
        if who is None:
            return RedirectResponse(self.home, 303)
        if not _is_own(request, form):
            return RedirectResponse(f"{self.home}/page", 303)
        if form.get("step") == str(who.step) and who.step < len(self._study.steps):
            question = self._study.steps[who.step].question
            values = values_of(self._study, question, form)
            if values is None:
                return self._ask(request, who, form)
            if self._has_seen(who):
                self._keep(request.cookies[COOKIE], who, values, self._pace(who, form))
                self._note_others(request, who)
        return RedirectResponse(f"{self.home}/page", 303)

    def _keep(
        self, code: str, who: Participant, values: Mapping[str, str], pace: AnswerPace | None
    ) -> None:
        """Store an answer, and skip the questions that no longer apply after it."""
        step, film = self._study.steps[who.step], self._film(who)
        about = film.name if film else None
        if not self._store.keep(code, who.step, about, step.question.name, values, pace):
            return
        if step.question.kind != "choice" or values[""] != NONE:
            return
        for place, later in enumerate(self._study.steps[who.step + 1 :], who.step + 1):
            if later.trial != step.trial or later.question.only_if != step.question.name:
                break
            self._store.keep(code, place, about, later.question.name, {"": SKIPPED})

    def _pace(self, who: Participant, form: Form) -> AnswerPace | None:
        """Return how long an answer took and how often its film was started; None if not kept."""
        shown = self._shown.pop((who.number, who.step), None)
        if not self._study.times:
            return None
        seconds = None if shown is None else round(self._clock() - shown, 1)
        return AnswerPace.told(seconds, form.get("plays", ""))

    def _gone(self) -> set[int]:
        """Return participants who left without finishing."""
        now = self._clock()
        return {
            number
            for number in self._store.unfinished(len(self._study.steps))
            if now - self._seen.get(number, self._began) > _GONE
        }

    def perform(self, request: Request, _form: Form) -> Response:
        """Have the robot in the room make the gesture, and wait for its end.

        Only a whole gesture counts as seen; otherwise a page tells what interfered.
        """
        who = self._who(request)
        film = self._film(who) if who is not None else None
        if who is None or film is None or not film.live or self._perform is None:
            return RedirectResponse(self.home, 303)
        if (turn := self._turns.begin(who.number)) is not Turn.YOURS:
            return self._show("notice.html", who.language, 409, notice=turn)
        try:
            self._note_others(request, who)
            showing = self._perform(Expression(film.feeling, film.mood))
        finally:
            self._turns.end(who.number)
        trial = self._study.steps[who.step].trial or 0
        if showing.begun:
            code = request.cookies[COOKIE]
            self._store.note_showing(code, trial, film.name, showing.ending)
        if showing.ending is not Ending.WHOLE:
            return self._show("notice.html", who.language, 503, notice=showing.ending)
        self._others[who.number, trial] = showing.others
        return RedirectResponse(f"{self.home}/page", 303)

    def _note_others(self, request: Request, who: Participant) -> None:
        """Record once that the robot made another gesture since this participant's."""
        film, trial = self._film(who), self._study.steps[who.step].trial or 0
        others = self._others.get((who.number, trial))
        if film is not None and others is not None and others():
            del self._others[who.number, trial]
            self._store.note_showing(request.cookies[COOKIE], trial, film.name, None)

    def leave(self, request: Request, form: Form) -> Response:
        """Free the robot and the browser for the next participant."""
        if (who := self._who(request)) is not None:
            if not _is_own(request, form):
                return RedirectResponse(f"{self.home}/page", 303)
            self._turns.leave(who.number)
        response = RedirectResponse(self.home, 303)
        response.delete_cookie(COOKIE, self.home)
        return response

    def ask_to_stop(self, request: Request) -> Response:
        """Ask a participant to confirm that they want to stop early."""
        if (who := self._who(request)) is None:
            return RedirectResponse(self.home, 303)
        return self._show("stopping.html", who.language, code=request.cookies[COOKIE])

    def stop(self, request: Request, form: Form) -> Response:
        """End the participation early, and show the debriefing."""
        who = self._who(request)
        if who is None or not _is_own(request, form):
            return RedirectResponse(f"{self.home}/page", 303)
        self._turns.leave(who.number)
        code = request.cookies[COOKIE]
        return self._remember(code + _STOPPED, self._show("stopped.html", who.language, code=code))

    def ask_to_withdraw(self, request: Request) -> Response:
        """Ask for the code."""
        code = _code(request) if self._owner(request) else ""
        return self._show("withdraw.html", self._language(request), code=code, wrong=False)

    def withdraw(self, request: Request, form: Form) -> Response:
        """Delete the answers of the participant with a code."""
        language = self._language(request)
        typed = form.get("code", "")
        code = read_code(typed)
        if not self._allowance.take(_asker(request)):
            return self._show("notice.html", language, 429, notice="busy")
        goes = self._find(code)
        if goes is None or not self._store.withdraw(code):
            return self._show("withdraw.html", language, 422, code=typed, wrong=True)
        self._turns.leave(goes.number)
        response = self._show("notice.html", language, notice="withdrawn")
        if _code(request) == code:
            response.delete_cookie(COOKIE, self.home)
        return response

    def film(self, request: Request) -> Response:
        """Send a film."""
        path = self._films.get(request.path_params["key"])
        if path is None:
            return Response(status_code=404)
        return FileResponse(path, headers={"cache-control": "private, max-age=3600"})

    def refuse(self, request: Request, error: Exception) -> Response:
        """Report that the study has ended, or that saving failed and earlier answers are safe."""
        try:
            language = self._language(request)
        except OutputError:  # nothing can be read, either
            language = preferred(self._study, request.headers.get("accept-language", ""))
        if isinstance(error, StudyClosedError):
            return self._show("notice.html", language, 410, notice="closed")
        _LOG.error("%s", error)
        return self._show("notice.html", language, 503, notice="full")

    def _who(self, request: Request) -> Participant | None:
        """Return the participant who goes on in this browser."""
        return self._find(request.cookies.get(COOKIE, ""))

    def _owner(self, request: Request) -> Participant | None:
        """Return the participant of this browser, who may have stopped."""
        return self._find(_code(request))

    def _find(self, code: str) -> Participant | None:
        if self._store.closed:  # by another process, perhaps, since the last request
            raise StudyClosedError("this study is closed.")
        return self._store.find(code)

    def _remember(self, value: str, response: Response) -> Response:
        response.set_cookie(
            COOKIE, value, _DAYS * 86_400, path=self.home, httponly=True, samesite="lax"
        )
        return response

    def _language(self, request: Request, wish: str | None = None) -> str:
        if (who := self._store.find(_code(request))) is not None:
            return who.language
        wish = wish or request.query_params.get("language")
        return preferred(self._study, wish or request.headers.get("accept-language", ""))

    def _film(self, who: Participant) -> Film | None:
        return film_at(self._study, who.place, who.step)

    def _has_seen(self, who: Participant) -> bool:
        """Whether the participant may answer: a live gesture must have been seen to its end."""
        film, trial = self._film(who), self._study.steps[who.step].trial
        live = film is not None and film.live and trial is not None
        return not live or self._store.has_seen(who.number, trial or 0)

    def _ask(
        self, request: Request, who: Participant, given: Mapping[str, str] | None = None
    ) -> Response:
        """Show a question; ``given`` is an answer to it that was not accepted."""
        study, code = self._study, request.cookies[COOKIE]
        if who.step >= len(study.steps):
            self._turns.leave(who.number)
            return self._show("thanks.html", who.language, code=code)
        self._seen[who.number] = self._clock()
        turn = self._turns.look(who.number)
        progress: dict[str, Any] = {"code": code, "step": who.step, "steps": len(study.steps)}
        if not self._has_seen(who):
            if turn is not Turn.YOURS:
                return self._show("notice.html", who.language, 409, notice=turn)
            return self._show("watch.html", who.language, **progress)
        step: Step = study.steps[who.step]
        question, film = step.question, self._film(who)
        self._shown.setdefault((who.number, who.step), self._clock())
        options = study.options(question)
        feelings = tuple(option for option in options if option != NONE)
        options = (*option_order(feelings, who.number, study.seed), *options[len(feelings) :])
        key = self._keys[film.name] if film and not film.live else None
        return self._show(
            "question.html",
            who.language,
            200 if given is None else 422,
            **progress,
            question=question,
            practice=step.practice,
            options=[(option, study.words(question, option, who.language)) for option in options]
            if question.kind != "pick"
            else [(one.name, pick(one.words, who.language)) for one in question.answers],
            film=f"{self.home}/film/{key}" if key else None,
            begins=who.step == 0 or study.steps[who.step - 1].trial != step.trial,
            moving=key is not None and self._films[key].suffix in (".mp4", ".webm"),
            live=film is not None and film.live,
            given=given or {},
            missing=given is not None,
            longest=LONGEST,
        )

    def _show(self, page: str, language: str, status: int = 200, **values: object) -> Response:
        study = self._study
        content = render(
            _PAGES / page,
            home=self.home,
            study=study,
            language=language,
            languages=[(each, page_words()[each]["own_name"]) for each in study.languages],
            title=pick(study.title, language),
            paragraphs=paragraphs(pick(study.information, language)),
            debriefing=paragraphs(pick(study.debriefing, language)) if study.debriefing else [],
            words=page_words()[language],
            rehearsal=self._store.rehearsal,
            text=lambda words: pick(words, language),
            **values,
        )
        # the next person may use the same tablet
        return HTMLResponse(content, status, {"cache-control": "no-store"})


def _code(request: Request) -> str:
    return request.cookies.get(COOKIE, "").removesuffix(_STOPPED)


def _is_own(request: Request, form: Form) -> bool:
    """Whether a form is the browser's present participant's; an older page may be another's."""
    return form.get("code") == request.cookies.get(COOKIE)


def _asker(request: Request) -> str:
    return request.client.host if request.client else "?"
