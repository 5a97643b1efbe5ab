/**
 * A partner, asked over HTTP from a browser, Node or Deno. Types come from the partner's own
 * description, in api.ts. See https://developer.mozilla.org/docs/Web/API/Fetch_API.
 */
import type { LiveEvent, State, components, paths } from "./api.js";

type Json<Content> = Content extends { content: { "application/json": infer Body } } ? Body : undefined;
type Operation<Path extends keyof paths, Method extends "get" | "post"> = NonNullable<paths[Path][Method]>;
type Asked<One> = One extends { requestBody: infer Body } ? Json<Body> : undefined;
type Answered<One> = One extends { responses: { 200: infer Answer } } ? Json<Answer> : undefined;
/** Paths that answer to a method, and have no name in them. */
type With<Method extends "get" | "post"> = {
  [Path in keyof paths]: Path extends `${string}{${string}` ? never : Operation<Path, Method> extends never ? never : Path;
}[keyof paths];

/** What the partner refused, or could not do. */
export class MiburiError extends Error {
  /** The status of the answer; 0: there was none. */
  readonly status: number;

  constructor(message: string, status: number) {
    super(message);
    this.status = status;
  }
}

/** s between two tries to come back to a lost stream; and of silence, after which it counts as lost. */
const AGAIN = 1, SILENCE = 30;

export class Partner {
  readonly address: string;
  readonly token: string | undefined;

  /**
   * @param address such as http://localhost:8080
   * @param token needed everywhere but on the partner's own computer
   */
  constructor(address: string, token?: string) {
    this.address = address.replace(/\/$/, "");
    this.token = token;
  }

  /** Look at something, such as /api/v1/state. */
  async get<Path extends With<"get">>(path: Path): Promise<Answered<Operation<Path, "get">>> {
    return (await this.#ask("GET", path)) as Answered<Operation<Path, "get">>;
  }

  /** Ask for something, such as /api/v1/express; returns the wish's id where there is one. */
  async post<Path extends With<"post">>(
    path: Path,
    ...[body]: Asked<Operation<Path, "post">> extends undefined ? [] : [Asked<Operation<Path, "post">>]
  ): Promise<Answered<Operation<Path, "post">>> {
    return (await this.#ask("POST", path, body)) as Answered<Operation<Path, "post">>;
  }

  /** Everything about the partner, now. */
  async state(): Promise<State> {
    return this.get("/api/v1/state");
  }

  /** Let it feel something. */
  async feel(feeling: components["schemas"]["StimulusIn"]["feeling"], strength = 0.8): Promise<void> {
    await this.post("/api/v1/stimulus", { feeling, strength });
  }

  /** Stop all motors, until a person releases them. */
  async stop(): Promise<void> {
    await this.post("/api/v1/stop");
  }

  /**
   * Yield what happens after an event, or from now on. A lost connection is made again, also over
   * a restart of the partner, and nothing is missed; what the partner no longer has is a `gap`. If
   * nobody answers at first, it throws.
   */
  async *events(after?: string, signal?: AbortSignal): AsyncGenerator<LiveEvent, void> {
    let cursor = after;
    let heard = false;
    while (!signal?.aborted) {
      try {
        if (cursor === undefined) {
          const { boot, latest } = await this.state();
          cursor = `${boot}:${latest}`;
        }
        for await (const event of this.#stream(cursor, signal)) {
          heard = true;
          if (event === null) continue;
          cursor = event.id;
          yield event;
        }
      } catch (error) {
        if (signal?.aborted) return;
        const final = error instanceof MiburiError && error.status >= 400 && error.status < 500;
        if (final || !heard) throw error;
      }
      await new Promise((resolve) => setTimeout(resolve, 1000 * AGAIN));
    }
  }

  /** Wait until a wish has ended, well or not; the event tells which. */
  async untilEnded(wish: string): Promise<LiveEvent> {
    let whole = "";
    const [boot, number] = wish.split(":");
    const before = encodeURIComponent(`${boot}:${Math.max(Number(number) - 1, 0)}`);
    const [first] = (await this.#ask("GET", `/api/v1/log?after=${before}`)) as LiveEvent[];
    const beyond = first !== undefined && first.boot === boot && first.number < Number(number) - 1; // a gap at the newest event
    if (first === undefined || beyond || (first.boot === boot && !["wish", "gap"].includes(first.kind))) {
      throw new MiburiError(`${wish} is not the id of a request that ends, such as express or speak.`, 0);
    }
    for await (const event of this.events(wish)) {
      if (event.boot !== boot || event.kind === "gap") break;
      if (event.wish !== wish) continue;
      const [what, ...how] = event.kind.split("_");
      if (how[0] === "begun") whole ||= what!; // of a performance the acts begin and end, too
      if (event.kind === "wish_dropped") return event;
      if (["ended", "broken"].includes(how[0]!) && what === (whole || what)) return event;
    }
    throw new MiburiError("the partner was restarted or lost these events: nobody knows how that wish ended.", 0);
  }

  /** Yield null once the stream is open, and then its events. */
  async *#stream(cursor: string, signal?: AbortSignal): AsyncGenerator<LiveEvent | null, void> {
    const line = new AbortController();
    const end = () => line.abort();
    const heard = async <Answer>(work: Promise<Answer>): Promise<Answer> => {
      const silence = setTimeout(end, 1000 * SILENCE);
      return work.finally(() => clearTimeout(silence));
    };
    signal?.addEventListener("abort", end);
    try {
      const answer = await heard(this.#fetch("GET", `/api/v1/events?after=${cursor}`, undefined, line.signal));
      yield null;
      const reader = answer.body!.pipeThrough(new TextDecoderStream()).getReader();
      let waiting = "";
      for (;;) {
        const { done, value } = await heard(reader.read());
        if (done) return;
        const lines = (waiting + value).split("\n");
        waiting = lines.pop()!;
        for (const line of lines) {
          if (line.startsWith("data: ")) yield JSON.parse(line.slice(6)) as LiveEvent;
        }
      }
    } finally {
      signal?.removeEventListener("abort", end);
      end(); // whoever leaves the loop leaves no open stream
    }
  }

  async #ask(method: string, path: string, body?: unknown): Promise<unknown> {
    const answer = await this.#fetch(method, path, body);
    return answer.status === 204 ? undefined : await answer.json();
  }

  async #fetch(method: string, path: string, body?: unknown, signal?: AbortSignal): Promise<Response> {
    const headers: Record<string, string> = {};
    if (this.token !== undefined) headers["Authorization"] = `Bearer ${this.token}`;
    if (body !== undefined) headers["Content-Type"] = "application/json";
    let answer: Response;
    try {
      answer = await fetch(this.address + path, {
        method,
        headers,
        ...(body === undefined ? {} : { body: JSON.stringify(body) }),
        ...(signal === undefined ? {} : { signal }),
      });
    } catch (error) {
      throw new MiburiError(`no answer from ${this.address}: ${(error as Error).message}`, 0);
    }
    if (!answer.ok) {
      const { detail } = (await answer.json().catch(() => ({}))) as { detail?: unknown };
      throw new MiburiError(typeof detail === "string" ? detail : JSON.stringify(detail), answer.status);
    }
    return answer;
  }
}
