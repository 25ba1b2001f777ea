"""What a picture of a page should not have: found in the page itself, in each language, on each screen."""

import re
from collections.abc import Iterator

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page

#: Latin words that a Chinese page may have: names, units, keys, notations of files and formulas.
_LATIN = re.compile(
    r"^(motorbench|English|Name|Password|Log|Ctrl|Esc|Enter|IPMSM|ipmsm|LG|lg|SN|Doe|Hz|rpm|mHz|UTC|SHA|LCR|DC|PDF|JSON|CSV|XML"
    r"|HTML|VESC|ODrive|Nm|mWb|EMF|records|plans|plan|sqlite|toml|virtual|expected|SVPWM|FOC|Kelvin|NIST|GUM|report|zip|PASS|FAIL)$"
)
#: Text that runs out of its box, stands on other text, or is too small; a page that is too wide; parts out of reach.
_LOOK = """() => {
    const told = new Set(), root = document.documentElement;
    const wide = root.scrollWidth - innerWidth;
    if (wide > 0) told.add(`${wide} px too wide`);
    const words = [];
    const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    const range = document.createRange();
    while (walk.nextNode()) {
        const node = walk.currentNode, parent = node.parentElement;
        if (!node.data.trim() || parent.closest('script, style, [aria-hidden=true] canvas, .mb-skip')) continue;
        if (!parent.checkVisibility({ visibilityProperty: true, opacityProperty: true })) continue;
        range.selectNodeContents(node);
        const said = node.data.trim().slice(0, 40);
        if (parseFloat(getComputedStyle(parent).fontSize) < 10.5 && !parent.closest('svg')) told.add(`small: ${said}`);
        // A word that only a screen reader says has no box.
        const head = parent.closest('thead');
        if (getComputedStyle(head ?? parent).clipPath !== 'none' || parent.closest('.mb-b-words')?.offsetWidth === 1) continue;
        for (const box of range.getClientRects()) {
            if (box.width < 2 || box.height < 2) continue;
            for (let at = parent; at && at !== document.body; at = at.parentElement) {
                const style = getComputedStyle(at), edge = at.getBoundingClientRect();
                const scrolls = /auto|scroll/.test(style.overflowX + style.overflowY);
                if (scrolls) break;
                if (style.display === 'contents') continue;
                const holds = at.matches('button, .q-btn, .mb-card, .mb-tile, .mb-state, td, th') || style.overflowX !== 'visible';
                if (holds && (box.left < edge.left - 2 || box.right > edge.right + 2)) told.add(`clipped: ${said}`);
                if (at.matches('button, .q-btn') && (box.top < edge.top - 2 || box.bottom > edge.bottom + 2)) told.add(`clipped: ${said}`);
            }
            words.push({ parent, box, said });
        }
    }
    const paints = (at) => { const colour = getComputedStyle(at); return colour.backgroundImage !== 'none'
        || !/, 0\\)$|transparent/.test(colour.backgroundColor); };
    for (let first = 0; first < words.length; first++) for (let second = first + 1; second < words.length; second++) {
        const [a, b] = [words[first], words[second]];
        if (a.parent === b.parent) continue;
        const left = Math.max(a.box.left, b.box.left), right = Math.min(a.box.right, b.box.right);
        const top = Math.max(a.box.top, b.box.top), bottom = Math.min(a.box.bottom, b.box.bottom);
        if (right - left < 3 || bottom - top < 0.4 * Math.min(a.box.height, b.box.height)) continue;
        const seen = document.elementsFromPoint((left + right) / 2, (top + bottom) / 2);
        const places = [a, b].map((one) => seen.findIndex((at) => at === one.parent)).sort((x, y) => x - y);
        if (places[0] < 0 || seen.slice(0, places[1]).some(paints)) continue;
        told.add(`overlap: ${a.said} | ${b.said}`);
    }
    for (const name of ['.mb-act .mb-done', '.mb-stop']) {
        const shown = [...document.querySelectorAll(name)].find((at) => at.checkVisibility());
        if (!shown) continue;
        const box = shown.getBoundingClientRect();
        if (box.left < 0 || box.top < 0 || box.right > innerWidth || box.bottom > innerHeight) told.add(`out of sight: ${name}`);
        if (box.height < 48) told.add(`lower than 48 px: ${name}`);
    }
    return [...told];
}"""
_WORDS = """() => {
    const said = [...document.querySelectorAll('[aria-label], [placeholder]')]
        .filter((at) => at.checkVisibility() && !at.closest('[aria-hidden=true]')).flatMap((at) => [at.ariaLabel, at.placeholder]);
    const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walk.nextNode()) {
        const at = walk.currentNode.parentElement;
        if (!at.closest('script, style, .q-icon, [aria-hidden=true]:not(svg *)') && at.checkVisibility()) said.push(walk.currentNode.data);
    }
    return said.join(' ');
}"""
_STILL = "document.getAnimations().filter((one) => one.playState === 'running').length"
WCAG = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]}}


def faults(page: Page) -> Iterator[str]:
    """Say what of the page's text cannot be read, and what is out of reach, on the present screen."""
    yield from page.evaluate(_LOOK)


def english_left(page: Page) -> Iterator[str]:
    """Say which words of a Chinese page are English."""
    words = re.findall(r"[A-Za-z]{4,}", page.evaluate(_WORDS))
    left = sorted({word for word in words if not _LATIN.match(word)})
    if left:
        yield f"not Chinese: {' '.join(left)}"


def findings(page: Page) -> Iterator[str]:
    """Say what axe finds against WCAG 2.2, levels A and AA."""
    for found in Axe().run(page, options=WCAG).response["violations"]:
        places = [node["html"][:120] for node in found["nodes"]]
        yield f"axe, {found['impact']}, {found['id']}: {len(places)} × {places[0]}"


def moving(page: Page) -> Iterator[str]:
    """Say how much moves where a person has asked for less of it."""
    page.emulate_media(reduced_motion="reduce")
    moves = page.evaluate(_STILL)
    page.emulate_media(reduced_motion="no-preference")
    if moves:
        yield f"{moves} parts move"
