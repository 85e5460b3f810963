// The list of studies: stories are begun from here.
import { post } from "./api.js";
import { attempt, say } from "./common.js";

document.addEventListener("click", async (event) => {
  const button = event.target.closest("[data-story]");
  if (!button) return;
  button.disabled = true;
  button.textContent = "Preparing…";
  say("preparing the recordings of the story");
  const made = await attempt(() => post(`/api/story/${button.dataset.story}`));
  if (made) location.href = `/study/${made.study}`;
  else { button.disabled = false; button.textContent = "Begin"; }
});
