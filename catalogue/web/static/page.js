"use strict";
document.documentElement.classList.add("script");
const one = (selector, within = document) => within.querySelector(selector);
const all = (selector, within = document) => [...within.querySelectorAll(selector)];
const REST = 250; // ms without a change before a search begins

// --- drawings that move: those out of sight, and all of them where less motion is wanted, stand still
const still = matchMedia("(prefers-reduced-motion: reduce)");
let paused = still.matches;
const seen = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    target.dataset.seen = isIntersecting ? "1" : "";
    run(target);
  }
});
function run(svg) {
  if (!svg.pauseAnimations) return;
  if (paused || !svg.dataset.seen || svg.dataset.held) svg.pauseAnimations();
  else svg.unpauseAnimations();
}
function watch(within) {
  for (const svg of all(".drawing > svg", within)) {
    svg.pauseAnimations();
    seen.observe(svg);
  }
}
const toggle = one("#motion");
function setPaused(value) {
  paused = value;
  toggle.setAttribute("aria-pressed", String(paused));
  toggle.textContent = paused ? "Play drawings" : "Pause drawings";
  all(".drawing > svg").forEach(run);
}
toggle.addEventListener("click", () => setPaused(!paused));
still.addEventListener("change", () => setPaused(still.matches));
setPaused(paused);
watch(document);

// --- the large drawing: play, pause, and a slider that is the position along the stroke
for (const controls of all("[data-controls]")) {
  const svg = one("svg", controls.parentElement);
  const [play, slider] = [one("[data-play]", controls), one("input", controls)];
  const period = Number(controls.dataset.seconds);
  const show = () => (play.textContent = svg.dataset.held || paused ? "Play" : "Pause");
  play.addEventListener("click", () => {
    const moving = !svg.dataset.held && !paused;
    svg.dataset.held = moving ? "1" : "";
    if (!moving && paused) setPaused(false);
    run(svg);
    show();
  });
  slider.addEventListener("input", () => {
    svg.dataset.held = "1";
    run(svg);
    svg.setCurrentTime((slider.value / 1000) * (period / 2));
    show();
  });
  const follow = () => {
    if (!svg.dataset.held && !paused) {
      const turn = (svg.getCurrentTime() % period) / period;
      slider.value = 1000 * (1 - Math.abs(1 - 2 * turn));
    }
    requestAnimationFrame(follow);
  };
  if (svg) follow();
  toggle.addEventListener("click", show);
  show();
  for (const box of all("[data-layer]", controls.parentElement)) {
    const set = () => svg.classList.toggle("hide-" + box.dataset.layer, !box.checked);
    box.addEventListener("change", set);
    set();
  }
}

// --- the wish
const wish = one("#wish");
if (wish) {
  const answers = one("#answers"), unfold = one("#unfold");
  let timer = 0, asked = null, dragging = false;
  const field = (name) => wish.elements.namedItem(name);
  const number = (text) => Number(String(text).replace(",", "."));
  const stroke = () => number(field("stroke").value) || 150;

  // what a slider runs over: from, to, and whether by factors; lengths in strokes
  const OVER = {
    length: [0.05, 20, true], deviation: [1e-6, 0.05, true], acute: [0, 85, false], turn: [0, 360, false], share: [0, 1, false],
  };
  const range = (slider) => {
    if (slider.dataset.for === "f-stroke") return [1, 10000, true];
    const [low, high, factors] = OVER[slider.dataset.over];
    const unit = slider.dataset.over === "length" || slider.dataset.over === "deviation" ? stroke() : 1;
    return [low * unit, high * unit, factors];
  };
  const read = (slider) => {
    const [low, high, factors] = range(slider), t = slider.value / 1000;
    const value = factors ? low * (high / low) ** t : low + (high - low) * t;
    return String(Number(value.toPrecision(slider.dataset.over === "acute" || slider.dataset.over === "turn" ? 2 : 3)));
  };
  const place = (slider) => {
    const [low, high, factors] = range(slider), input = document.getElementById(slider.dataset.for);
    const value = number(input.value), set = input.value.trim() !== "" && Number.isFinite(value);
    const t = factors ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
    slider.classList.toggle("unset", !set);
    slider.value = set ? 1000 * Math.min(1, Math.max(0, t)) : /^(max|stroke)/.test(input.name) ? 1000 : 0;
    slider.setAttribute("aria-valuetext", set ? input.value : "any");
  };
  const sliders = all("input[type=range]", wish);
  const placeAll = () => sliders.forEach(place);
  const byPath = () => {
    const arc = field("path").value === "circular-arc";
    for (const one of [field("radius"), field("angle")].filter(Boolean)) {
      one.disabled = !arc;
      one.closest(".field").hidden = !arc;
    }
  };

  const address = () => {
    const said = new URLSearchParams();
    for (const [name, value] of new FormData(wish)) if (name !== "pick" && String(value).trim()) said.append(name, value);
    for (const code of picked()) said.append("pick", code);
    return said;
  };
  const tell = (found) => {
    all(".field", wish).forEach((one_) => {
      const wrong = found.dataset.field === one_.dataset.name && found.dataset.error;
      one_.classList.toggle("wrong", Boolean(wrong));
      const line = one(".error", one_);
      if (line) line.textContent = wrong ? found.dataset.error : "";
      if (wrong) {
        one_.closest("details")?.setAttribute("open", "");
        unfold.checked = true;
      }
    });
  };
  async function ask(stage) {
    asked?.abort();
    const mine = (asked = new AbortController());
    const load = async (which) => {
      const said = address();
      said.set("stage", which);
      return (await fetch("/answers?" + said, { signal: mine.signal })).text();
    };
    const show = (text) => {
      answers.innerHTML = text;
      const found = one(".found", answers);
      if (found) tell(found);
      watch(answers);
      count();
      return found;
    };
    let done = false;
    answers.setAttribute("aria-busy", "true");
    if (stage === "refined" && !one(".card", answers)) // nothing is shown yet: the first that are found
      load("early").then((text) => { if (!done && !mine.signal.aborted) show(text); }).catch(() => {});
    try {
      const text = await load(stage);
      done = true;
      if (mine.signal.aborted) return;
      const found = show(text);
      if (found && !found.dataset.error && found.dataset.refined === "0" && !dragging) return ask("refined");
      answers.setAttribute("aria-busy", "false");
    } catch (error) {
      if (error.name === "AbortError") return;
      answers.innerHTML = '<div class="found"><p class="line error" role="alert">The page does not answer: is <code>catalogue serve</code> still running?</p></div>';
      answers.setAttribute("aria-busy", "false");
    }
  }
  const say = () => {
    one("#said").textContent = `${field("path").value.replace("-", " ")}, stroke ${field("stroke").value}, deviation ${field("deviation").value}`;
  };
  const settle = () => {
    say();
    clearTimeout(timer);
    timer = setTimeout(() => {
      const there = "/?" + address();
      if (!dragging && there !== location.pathname + location.search) history.pushState(null, "", there);
      ask("draft");
    }, REST);
  };

  // --- the shortlist stands in the address
  const hidden = new Set(new URLSearchParams(location.search).getAll("pick"));
  const picked = () => [...hidden];
  const tray = one("#tray");
  function count() {
    for (const box of all("input[name=pick]", answers)) box.checked = hidden.has(box.value);
    for (const old of all("input[type=hidden][name=pick]", tray)) old.remove();
    const shown = new Set(all("input[name=pick]", answers).map((box) => box.value));
    for (const code of hidden) if (!shown.has(code)) tray.insertAdjacentHTML("beforeend", `<input type="hidden" name="pick" value="${code.replace(/\W/g, "")}">`);
    tray.dataset.count = hidden.size;
    one("#picked").textContent = `${hidden.size} on the shortlist`;
    one("button", tray).disabled = !hidden.size;
  }
  answers.addEventListener("change", ({ target }) => {
    if (target.name !== "pick") return;
    target.checked ? hidden.add(target.value) : hidden.delete(target.value);
    history.replaceState(null, "", "/?" + address());
    count();
  });

  for (const slider of sliders) {
    slider.addEventListener("input", () => {
      dragging = true;
      document.getElementById(slider.dataset.for).value = read(slider);
      slider.classList.remove("unset");
      slider.setAttribute("aria-valuetext", read(slider));
      settle();
    });
    slider.addEventListener("change", () => {
      dragging = false;
      settle();
    });
  }
  wish.addEventListener("input", ({ target }) => {
    if (target.type === "range") return;
    if (target.name === "unit") return;
    byPath();
    placeAll();
    settle();
  });
  one("#f-unit").addEventListener("change", () => wish.requestSubmit());
  wish.addEventListener("submit", () => {
    for (const input of all("input, select, textarea", wish)) if (input.name && input.type !== "radio" && !String(input.value).trim()) input.disabled = true;
  });
  addEventListener("popstate", () => location.reload());
  addEventListener("pageshow", ({ persisted }) => persisted && location.reload());
  byPath();
  placeAll();
  count();
  const found = one(".found", answers);
  unfold.checked = Boolean(found?.dataset.error);
  if (found?.dataset.start) ask("draft");
  else if (found && !found.dataset.error && found.dataset.refined === "0") ask("refined");
}

// --- an own linkage
const board = one("#board");
if (board) {
  const form = one("#own"), told = one("#told"), problem = one("#own-error");
  const [text, px, py] = ["linkage", "x", "y"].map((name) => form.elements.namedItem(name));
  const NAMES = [["A1", "A1*"], ["A2", "A2*"]];
  let state = null, box = null, asked = null, again = false, timer = 0, grabbed = null;
  const key = (n) => Number(n.toPrecision(7));

  function fit() {
    const places = [...state.path, state.guided];
    for (const dyad of state.pivots) for (const [x, y, w] of dyad) if (w) places.push([x, y]);
    const xs = places.map((p) => p[0]), ys = places.map((p) => -p[1]);
    let [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const size = 1.3 * Math.max(x1 - x0, (y1 - y0) * 4 / 3, 1e-9);
    box = [(x0 + x1 - size) / 2, (y0 + y1 - size * 3 / 4) / 2, size, size * 3 / 4];
    board.setAttribute("viewBox", box.join(" "));
  }
  // where a pivot at infinity is shown: off its partner, in its direction
  const shown = (dyad, i) => {
    const [x, y, w] = dyad[i];
    if (w) return [x, y];
    const [mx, my] = dyad[1 - i], far = 0.2 * box[2];
    return [mx + x * far, my + y * far];
  };
  const line = (places) => places.map(([x, y], i) => `${i ? "L" : "M"}${x} ${-y}`).join("");
  function draw() {
    const r = box[2] / 90, parts = [];
    parts.push(`<path class="way" d="${line(state.path)}"/>`);
    for (const dyad of state.pivots) {
      const [a, b] = [shown(dyad, 0), shown(dyad, 1)];
      const rail = dyad.findIndex((pivot) => !pivot[2]);
      if (rail < 0) parts.push(`<path class="bar" d="${line([a, b])}"/>`);
      else {
        const [x, y] = dyad[rail], [mx, my] = dyad[1 - rail], far = box[2];
        parts.push(`<path class="rail" d="${line([[mx - y * far, my + x * far], [mx + y * far, my - x * far]])}"/>`);
      }
    }
    const corners = [...state.pivots.filter((d) => d[1][2]).map((d) => [d[1][0], d[1][1]]), state.guided];
    parts.push(`<path class="coupler" d="${line(corners)}Z"/><path class="stretch" d="${line(state.stretch)}"/>`);
    board.replaceChildren();
    board.insertAdjacentHTML("beforeend", parts.join(""));
    const handle = (name, [x, y], kind, move) => {
      board.insertAdjacentHTML("beforeend", `<g class="handle ${kind}" tabindex="0" role="slider" aria-label="${name}" aria-valuenow="${key(x)}" aria-valuetext="${name} at ${key(x)}, ${key(y)}" data-name="${name}"><circle class="ring" cx="${x}" cy="${-y}" r="${2.6 * r}"/><circle cx="${x}" cy="${-y}" r="${r}"/><text x="${x + 1.5 * r}" y="${-y - 1.5 * r}" style="font-size:${2.6 * r}px">${name}</text></g>`);
      const made = board.lastElementChild;
      made.addEventListener("pointerdown", (event) => { grabbed = { name, move }; board.setPointerCapture(event.pointerId); made.focus(); event.preventDefault(); });
      made.addEventListener("keydown", (event) => {
        const step = (event.shiftKey ? 10 : 1) * box[2] / 400;
        const by = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] }[event.key];
        if (!by) return;
        event.preventDefault();
        move(x + by[0], y + by[1]);
        changed(true, name);
      });
    };
    state.pivots.forEach((dyad, d) => dyad.forEach((pivot, i) => handle(NAMES[d][i], shown(dyad, i), i ? "moving" : "fixed", (x, y) => {
      if (pivot[2]) [pivot[0], pivot[1]] = [key(x), key(y)];
      else {
        const [mx, my] = dyad[1 - i], far = Math.hypot(x - mx, y - my) || 1;
        [pivot[0], pivot[1]] = [(x - mx) / far, (y - my) / far];
      }
    })));
    handle("P", state.guided, "guided", (x, y) => (state.guided = [key(x), key(y)]));
  }
  function changed(settled, focus) {
    text.value = JSON.stringify(state.pivots.map((dyad) => dyad.map(([x, y, w]) => (w ? [key(x), key(y)] : [x, y, 0]))));
    [px.value, py.value] = state.guided.map(String);
    draw();
    if (focus) one(`[data-name="${focus}"]`, board)?.focus();
    clearTimeout(timer);
    if (settled) timer = setTimeout(() => ask(true), REST);
    ask(false);
  }
  // while it is dragged one question at a time, always the newest; what comes too late is not shown
  async function ask(settled) {
    if (asked && !settled) { again = true; return; }
    asked?.abort();
    const mine = (asked = new AbortController());
    again = false;
    const said = new URLSearchParams(new FormData(form));
    said.set("stage", settled ? "settled" : "draft");
    try {
      const answer = await fetch("/own/measured?" + said, { signal: mine.signal });
      const found = await answer.json();
      if (mine.signal.aborted) return;
      problem.textContent = found.error && !found.told ? found.error : "";
      if (found.told !== undefined) {
        const mended = grabbed || !settled;
        state = mended && state ? { ...state, path: found.path, stretch: found.stretch } : found;
        if (!box) fit();
        const focus = document.activeElement?.dataset?.name;
        draw();
        if (focus) one(`[data-name="${focus}"]`, board)?.focus();
        if (settled) {
          told.innerHTML = found.told;
          watch(told);
          said.delete("stage");
          history.replaceState(null, "", "/own?" + said);
        } else {
          const numbers = document.createElement("div");
          numbers.innerHTML = found.told;
          const [old, fresh] = [one(".values", told), one(".values", numbers)];
          if (old && fresh) old.replaceWith(fresh); else told.innerHTML = found.told;
        }
      }
    } catch (error) {
      if (error.name !== "AbortError") problem.textContent = "The page does not answer: is `catalogue serve` still running?";
    }
    if (asked === mine) asked = null;
    if (again) ask(false);
  }
  board.addEventListener("pointermove", (event) => {
    if (!grabbed) return;
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(board.getScreenCTM().inverse());
    grabbed.move(at.x, -at.y);
    changed(false, grabbed.name);
  });
  board.addEventListener("pointerup", () => {
    if (!grabbed) return;
    grabbed = null;
    ask(true);
  });
  form.addEventListener("input", () => {
    clearTimeout(timer);
    timer = setTimeout(() => { box = null; state = null; ask(true); }, REST);
  });
  form.addEventListener("submit", (event) => { event.preventDefault(); box = null; state = null; ask(true); });
  ask(true);
}
