// A button starts the film: a browser's controls would lie over the hands. How often it was started
// goes with the answer; it counts when pictures come. The first question about a film can be answered
// once it was started, or if the browser cannot show it: the page says so, and lets it load again.
const film = document.querySelector("video"), start = document.getElementById("start");
const plays = document.getElementById("plays");
const first = document.getElementById("film-first"), onward = document.getElementById("onward");
const failed = document.getElementById("film-failed"), play = start.textContent;
let starting = false;
const wait = (waiting) => {
  if (!first) return;
  first.hidden = !waiting;
  onward.disabled = waiting;
};
const fail = () => {
  starting = start.disabled = failed.hidden = false;
  start.textContent = start.dataset.retry;
  wait(false);
};
film.controls = false;
start.hidden = false;
if (plays && !plays.value) plays.value = 0;
wait(!Number(plays?.value));
if (film.error) fail();
film.addEventListener("error", fail);
start.addEventListener("click", () => {
  if (film.error) film.load();
  else film.currentTime = 0;
  film.play().catch(() => {}); // the event "error" tells of it
});
film.addEventListener("play", () => {
  starting = start.disabled = true;
});
film.addEventListener("playing", () => {
  if (!starting) return; // it had only waited for the network
  starting = false;
  failed.hidden = true;
  start.textContent = play;
  if (plays) plays.value = Number(plays.value) + 1;
  wait(false);
});
film.addEventListener("ended", () => {
  start.disabled = false;
  start.textContent = start.dataset.again;
});
