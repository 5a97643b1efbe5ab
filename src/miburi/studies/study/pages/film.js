// A button starts the film: a browser's controls would lie over the hands. How often it was started
// goes with the answer.
const film = document.querySelector("video"), start = document.getElementById("start");
const plays = document.getElementById("plays");
film.controls = false;
start.hidden = false;
if (plays && !plays.value) plays.value = 0;
start.addEventListener("click", () => {
  film.currentTime = 0;
  film.play();
});
film.addEventListener("play", () => {
  start.disabled = true;
  if (plays) plays.value = Number(plays.value) + 1;
});
film.addEventListener("ended", () => {
  start.disabled = false;
  start.textContent = start.dataset.again;
});
