"use strict";
// What must work without the server, or faster than it: whether it is heard, Enter, focus, sound.
(() => {
    const LOST = 3000; // ms of silence
    const STOOD = 2000; // ms between two looks: the page itself stood still, and hears only now what came
    const SLEPT = 10000; // ms between two looks, by a clock that goes on in a computer's sleep: what is shown is as old
    const SLOW = 1500; // ms in which a server that answers again is heard again
    const SETTLED = 6000; // ms that a page has to hear the server for the first time
    const RENEWING = 5000; // ms that a slow server has for a new connection
    const LOADING = 20000; // ms that a slow server has for a page, or for one that is loaded anew: asked again, it would begin again
    const CONFIRM = 400; // ms after a step appears, so that one press cannot confirm two
    const PAUSE = 1000; // ms after which what was typed outside of a field is no code any more
    const PUTTING = 60000; // ms after the server was first heard in which a step's parts may be made anew, and lose what was put back
    const FRESH = 30000; // ms that a code which nobody took is worth a word
    const KEPT = "motorbench_typed";
    const LATE = "motorbench_late";
    const root = document.documentElement;
    const find = (selector) => document.querySelector(selector);
    let heard = performance.now();
    const born = heard;
    let [asked, reloaded] = [-LOADING, -LOADING];
    let awake = heard;
    let wall = Date.now();
    let joined = 0;
    let touched = false;
    let focused = null;

    function lostNow() {
        return root.classList.contains("mb-lost");
    }

    function watch() {
        const now = performance.now();
        const still = Math.max(now - awake, Date.now() - wall);
        if (still > SLEPT) heard = Math.min(heard, now - still);
        else if (still > STOOD) heard = Math.max(heard, now - STOOD);
        [awake, wall] = [now, Date.now()];
        // What is hidden while it has the focus loses it, and nothing else changes for that.
        if (focused && !focused.checkVisibility()) {
            focused = null;
            regain();
        }
        const silent = now - heard;
        const lost = silent > LOST && find("[data-beat]") !== null;
        if (lost !== lostNow()) {
            root.classList.toggle("mb-lost", lost);
            sound(lost ? "lost" : "");
            // What was hidden as long as nobody heard has lost the focus.
            if (!lost) setTimeout(regain);
        }
        if (lost) {
            const age = Math.round(silent / 1000);
            for (const place of document.querySelectorAll("[data-words]")) {
                const words = place.dataset.words.replace("{age}", age);
                // What does not change is left alone: a change is noticed, and would be looked at again.
                if (place.textContent !== words) place.textContent = words;
            }
        }
    }

    // Where only the connection died, a new one finds the page as it is: what was pressed and chosen stays. A server that was
    // started anew does not know the page, and NiceGUI loads it anew. What else silences a server that answers, loading may end.
    async function comeBack() {
        const now = performance.now();
        if (!lostNow() || now - born < SETTLED || now - asked < RENEWING) return;
        try {
            const answer = await fetch("/assets/page.css", { cache: "no-store" });
            await new Promise((resolve) => setTimeout(resolve, SLOW));
            if (answer.status >= 500 || !lostNow() || performance.now() - asked < RENEWING) return;
            asked = performance.now();
            if (asked - heard > LOADING && asked - reloaded > LOADING) {
                reloaded = asked;
                location.reload();
            } else if (window.socket?.connected) window.socket.io.engine.close();
        } catch {
            // Still nobody there.
        }
    }

    function typedIn() {
        return [...document.querySelectorAll("input[data-kept]")].filter((field) => field.offsetParent);
    }

    function unitsOf(field) {
        return [...(field.closest(".mb-field")?.querySelectorAll("[role=radio]") ?? [])];
    }

    // What was typed and not entered outlives the loading, with the unit that was chosen for it: whoever loads the page
    // anew, for NiceGUI does so itself where a server that was started anew does not know it, and in whatever language.
    function keepTyped() {
        // A page that is loaded again before it has its fields keeps what the one before kept.
        if (sessionStorage.getItem(KEPT) && !touched) return;
        const fields = typedIn().map((field) => ({
            name: field.dataset.kept,
            words: field.value,
            unit: unitsOf(field).find((unit) => unit.getAttribute("aria-checked") === "true")?.textContent.trim(),
        }));
        sessionStorage.setItem(KEPT, JSON.stringify({ path: location.pathname, fields }));
    }

    // For the same question only, and once the server hears what is put in; never against somebody's hands.
    function putBack() {
        const kept = JSON.parse(sessionStorage.getItem(KEPT) ?? "null");
        const loaded = performance.getEntriesByType("navigation")[0]?.type;
        if (loaded !== "reload" || kept?.path !== location.pathname || touched || performance.now() - joined > PUTTING) {
            sessionStorage.removeItem(KEPT);
            return;
        }
        for (const { name, words, unit } of kept.fields) {
            const field = typedIn().find((one) => one.dataset.kept === name);
            if (!field) continue;
            const chosen = unitsOf(field).find((one) => one.textContent.trim() === unit);
            if (chosen && chosen.getAttribute("aria-checked") !== "true") chosen.click();
            if (!words || field.value === words) continue;
            field.value = words;
            field.dispatchEvent(new Event("input", { bubbles: true }));
            // What is typed next goes on from there.
            if (document.activeElement === field) field.setSelectionRange(words.length, words.length);
        }
    }

    // What is scanned while the page is lost, or is loaded anew, reaches nobody, or nobody knows: the page says so once it is
    // heard again. To take it then would confirm what nobody has read.
    let stray = "";
    let sent = { words: "", at: -FRESH };

    // With a path it is told there only: a page that leads to the next has taken it.
    function keepLate(words, path = null) {
        const late = { path, words: words.slice(0, 60), at: Date.now() };
        sessionStorage.setItem(LATE, JSON.stringify(late));
    }

    function strayed(event) {
        if (event.ctrlKey || event.altKey || event.metaKey) return;
        if (event.key.length === 1) stray += event.key;
        else if (event.key === "Enter" && stray.trim()) {
            keepLate(stray.trim());
            stray = "";
        }
    }

    function keepCodes() {
        if (code.trim() || stray.trim()) keepLate((stray + code).trim());
        else if (sent.words && performance.now() - sent.at < FRESH) keepLate(sent.words, location.pathname);
    }

    function tellLate() {
        const late = JSON.parse(sessionStorage.getItem(LATE) ?? "null");
        const note = [...document.querySelectorAll("[data-late]")].find((one) => one.parentElement.offsetParent);
        if (!late || !note) return;
        sessionStorage.removeItem(LATE);
        if ((late.path ?? location.pathname) === location.pathname && Date.now() - late.at < FRESH) {
            note.textContent = note.dataset.late.replace("{code}", () => late.words);
        }
    }

    // Whoever presses the next key has had the time to read it; what the bench does meanwhile takes it away from nobody.
    function forgetLate() {
        for (const note of document.querySelectorAll("[data-late]")) note.textContent = "";
    }

    // What is pressed on a page that hears nothing would arrive later, at another step.
    function refuse(event) {
        if (event.type === "keydown") (lostNow() || !find("[data-beat]") ? strayed : forgetLate)(event);
        // A foot switch that is held down counts once, whatever comes to stand under it.
        const held = event.type === "keydown" && event.key === "Enter" && event.repeat;
        if (held || (lostNow() && !(event.type === "keydown" && event.key === "Tab") && !event.target.closest?.("a"))) {
            event.preventDefault();
            event.stopImmediatePropagation();
        }
    }

    function early(event) {
        if (event.target.closest?.("[data-done][aria-disabled], [data-next][aria-disabled]")) {
            event.preventDefault();
            event.stopImmediatePropagation();
        }
    }

    function confirm(event) {
        const done = find("[data-done]");
        if (event.key !== "Enter" || !done || event.defaultPrevented || event.isComposing) return;
        if (event.ctrlKey || event.altKey || event.metaKey) return;
        const other = event.target.closest?.("button, a, [role=button], [role=option], summary");
        if (other && other !== done) return;
        event.preventDefault();
        event.stopImmediatePropagation();
        done.click();
    }

    // What a scanner types outside of a field is a code: one of them confirms, those of a question's answers choose, and the
    // Enter of no other presses anything.
    let code = "";
    let typedAt = 0;

    function answerOf(words) {
        const answers = [...document.querySelectorAll("[data-codes]")].filter((one) => one.offsetParent);
        return answers.find((one) => one.dataset.codes.split(" ").includes(words.toUpperCase()));
    }

    function coded(event) {
        const notes = [...document.querySelectorAll("[data-untaken]")];
        const note = notes.find((one) => one.parentElement.offsetParent);
        if (!note || event.ctrlKey || event.altKey || event.metaKey || find(".q-menu")) return;
        if (event.timeStamp - typedAt > PAUSE) code = "";
        if (event.target.matches?.("input:not([readonly], [type=checkbox], [type=radio]), textarea")) {
            // What is typed after an entry takes the place of what stands there.
            if (event.key === "Enter" && event.target.matches("[data-focus]")) event.target.select();
            note.textContent = code = "";
            return;
        }
        if (event.target.matches?.("[role=combobox]")) return;
        if (event.key.length === 1) {
            if (event.key === " " && !code) return;
            note.textContent = "";
            const field = find("input[data-focus]:not([disabled], [type=radio])");
            if (field?.offsetParent) {
                event.stopImmediatePropagation();
                field.focus();
                field.select();
                return;
            }
            code += event.key;
            typedAt = event.timeStamp;
            answerOf(code)?.click();
            if (event.key === " ") event.preventDefault();
        } else if (event.key === "Enter" && code) {
            event.preventDefault();
            event.stopImmediatePropagation();
            const places = [...document.querySelectorAll("[data-done], [data-next]")];
            const done = places.find((one) => one.offsetParent);
            const words = code.trim();
            code = "";
            const answer = answerOf(words);
            if (answer && !answer.checked) answer.click();
            const confirms = words.toUpperCase() === note.dataset.code || answer !== undefined;
            if (done && confirms) {
                sent = { words, at: performance.now() };
                done.click();
            } else note.textContent = note.dataset[confirms ? "idle" : "untaken"].replace("{code}", () => words.slice(0, 60));
        }
    }

    // A space in a code presses no button either.
    function spaced(event) {
        if (event.key === " " && code) event.preventDefault();
    }

    // A scanner types wherever the cursor is, except where a person types: the field for it takes it, a list does not move.
    function scanned(event) {
        const field = find("[data-scan]:not([disabled])");
        if (!field?.offsetParent || event.ctrlKey || event.altKey || event.metaKey || find(".q-menu")) return;
        // What is scanned next takes the place of what stands there.
        if (event.key === "Enter" && event.target === field) field.select();
        const writes = event.target.matches?.("input:not([readonly], [type=checkbox], [type=radio]), textarea");
        if (event.key.length !== 1 || event.key === " " || writes) return;
        event.stopImmediatePropagation();
        field.focus();
        field.select();
    }

    function enlarge(on) {
        root.classList.toggle("mb-large", on);
        find("[data-larger]")?.setAttribute("aria-pressed", String(on));
    }

    function appeared() {
        sent.words = "";
        // What is to be done now is not hidden behind the drawing.
        enlarge(false);
        for (const note of document.querySelectorAll("[data-untaken]")) note.textContent = "";
        // A second press at the same place would confirm what nobody has read.
        for (const button of document.querySelectorAll("[data-done], [data-next]")) {
            button.setAttribute("aria-disabled", "true");
            setTimeout(() => button.removeAttribute("aria-disabled"), CONFIRM);
        }
        // Once the step's parts stand: they come in the same message, and on a slow machine a moment later.
        setTimeout(focus);
        setTimeout(regain, CONFIRM);
    }

    function focus() {
        const place = find("[data-focus]:not([disabled])");
        place?.focus({ preventScroll: true });
        place?.select?.();
    }

    // Parts that go take the focus with them, also where what stands for them was there before.
    function regain() {
        if (document.activeElement === null || document.activeElement === document.body) focus();
    }

    function pressed(event) {
        const button = event.target.closest?.("button");
        if (!button) return;
        if (button.dataset.again !== undefined) {
            find("[data-focus]")?.focus();
            find("[data-focus]")?.select?.();
        }
        if (button.dataset.larger !== undefined) enlarge(!root.classList.contains("mb-large"));
        if (button.dataset.mute !== undefined) {
            localStorage.setItem("motorbench_muted", muted() ? "" : "yes");
            show();
        }
    }

    const TONES = { on: [660, 880], aborting: [880, 660, 880], off: [440], unknown: [330, 330], lost: [220, 220, 220] };
    let audio = null;

    function muted() {
        return localStorage.getItem("motorbench_muted") === "yes";
    }

    function show() {
        find("[data-mute]")?.setAttribute("aria-pressed", String(muted()));
    }

    // Browsers let a page sound only once somebody has touched it.
    function allow() {
        audio ??= new AudioContext();
    }

    function sound(state) {
        if (!audio || muted()) return;
        (TONES[state] ?? []).forEach((pitch, number) => {
            const tone = audio.createOscillator();
            const gain = audio.createGain();
            const begin = audio.currentTime + 0.18 * number;
            tone.frequency.value = pitch;
            gain.gain.setValueAtTime(0.12, begin);
            gain.gain.exponentialRampToValueAtTime(0.001, begin + 0.16);
            tone.connect(gain).connect(audio.destination);
            tone.start(begin);
            tone.stop(begin + 0.17);
        });
    }

    new MutationObserver((changes) => {
        for (const { attributeName, target, addedNodes, removedNodes } of changes) {
            if (attributeName === "data-beat") {
                heard = performance.now();
                joined ||= heard;
                if (sessionStorage.getItem(KEPT)) setTimeout(putBack);
                if (sessionStorage.getItem(LATE)) setTimeout(tellLate);
            }
            if (attributeName === "data-step") appeared();
            if (attributeName === "data-sound") sound(target.dataset.sound);
            const among = (nodes, name) => [...nodes].some((node) => node.matches?.(name) || node.querySelector?.(name));
            const added = (name) => among(addedNodes, name);
            if (added("[data-focus]") || among(removedNodes, "[data-focus]")) setTimeout(regain);
            if (added("[data-result]")) appeared();
            if (added("[data-beat]")) {
                heard = performance.now();
                root.lang = find("[data-beat]").dataset.lang;
                appeared();
                show();
            }
        }
        if (lostNow()) watch();
    }).observe(root, {
        subtree: true,
        childList: true,
        attributes: true,
        attributeFilter: ["data-beat", "data-step", "data-sound"],
    });
    for (const kind of ["click", "keydown", "pointerdown", "input"]) window.addEventListener(kind, refuse, true);
    for (const hear of [coded, confirm, scanned]) window.addEventListener("keydown", hear, true);
    window.addEventListener("keyup", spaced, true);
    window.addEventListener("click", early, true);
    window.addEventListener("click", pressed);
    window.addEventListener("keydown", (event) => event.key === "Escape" && enlarge(false));
    for (const kind of ["pointerdown", "keydown"]) window.addEventListener(kind, allow);
    for (const kind of ["pointerdown", "keydown", "input"]) {
        window.addEventListener(kind, (event) => (touched ||= event.isTrusted), true);
    }
    window.addEventListener("pagehide", keepTyped);
    window.addEventListener("pagehide", keepCodes);
    window.addEventListener("focusin", (event) => (focused = event.target));
    setInterval(watch, 250);
    setInterval(comeBack, 2000);
})();
