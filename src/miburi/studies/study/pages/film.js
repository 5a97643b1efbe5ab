// A button starts the film: a browser's controls would lie over the hands. How often it was started
// goes with the answer. The first question about a film can be answered once it was started, or if
// the browser cannot play it.
const film = document.querySelector("video"), start = document.getElementById("start");
const plays = document.getElementById("plays");
const first = document.getElementById("film-first"), onward = document.getElementById("onward");
const wait = (waiting) => {
  if (!first) return;
  first.hidden = !waiting;
  onward.disabled = waiting;
};
const fail = () => {
  if (plays) plays.value = "";
  wait(false);
};
film.controls = false;
start.hidden = false;
if (plays && !plays.value) plays.value = 0;
wait(!Number(plays?.value));
if (film.error) fail();
film.addEventListener("error", fail);
start.addEventListener("click", () => {
  film.currentTime = 0;
  film.play();
});
film.addEventListener("play", () => {
  start.disabled = true;
  if (plays) plays.value = Number(plays.value) + 1;
  wait(false);
});
film.addEventListener("ended", () => {
  start.disabled = false;
  start.textContent = start.dataset.again;
});
