"""The style of all pages: browsers' defaults removed, classes named by their purpose, and the panel's own."""

from nicegui import ui

from bench.panel.pages.end_stylesheet import add_end_style

#: The classes have Tailwind's names and meanings. Tailwind itself would work them out in the browser, anew at each change.
_STYLE = """
<style>
@layer base {
  *, ::after, ::before, ::backdrop, ::file-selector-button { box-sizing: border-box; margin: 0; padding: 0; border: 0 solid; }
  html { line-height: 1.5; -webkit-text-size-adjust: 100%; tab-size: 4; -webkit-tap-highlight-color: transparent; }
  h1, h2, h3, h4, h5, h6 { font-size: inherit; font-weight: inherit; }
  a { color: inherit; text-decoration: inherit; }
  b, strong { font-weight: bolder; }
  table { text-indent: 0; border-color: inherit; border-collapse: collapse; }
  ol, ul, menu { list-style: none; }
  img, svg, canvas { display: block; vertical-align: middle; }
  img { max-width: 100%; height: auto; }
  button, input, select, textarea, ::file-selector-button { font: inherit; font-feature-settings: inherit;
    font-variation-settings: inherit; letter-spacing: inherit; color: inherit; border-radius: 0;
    background-color: transparent; opacity: 1; }
  ::placeholder { opacity: 1; color: color-mix(in oklab, currentcolor 50%, transparent); }
  textarea { resize: vertical; }
  button, input:where([type=button], [type=reset], [type=submit]) { appearance: button; }
  ::-webkit-inner-spin-button, ::-webkit-outer-spin-button { height: auto; }
  [hidden]:where(:not([hidden=until-found])) { display: none !important; }
}
@layer utilities {
  .sticky { position: sticky; } .top-bar { top: 0; } .bottom-0 { bottom: 0; } .z-10 { z-index: 10; }
  .m-0 { margin: 0; } .mx-auto { margin-inline: auto; } .ml-auto { margin-left: auto; }
  .my-2 { margin-block: .5rem; } .my-3 { margin-block: .75rem; }
  .mt-2 { margin-top: .5rem; } .mt-3 { margin-top: .75rem; } .mt-4 { margin-top: 1rem; } .mt-16 { margin-top: 4rem; }
  .mb-1 { margin-bottom: .25rem; } .mb-2 { margin-bottom: .5rem; } .mb-3 { margin-bottom: .75rem; }
  .mb-4 { margin-bottom: 1rem; }
  .flex { display: flex; } .grid { display: grid; }
  .h-64 { height: 16rem; } .h-80 { height: 20rem; } .h-96 { height: 24rem; }
  .w-5 { width: 1.25rem; } .w-48 { width: 12rem; } .w-64 { width: 16rem; } .w-72 { width: 18rem; max-width: 100%; }
  .w-96 { width: 24rem; max-width: 100%; } .w-full { width: 100%; } .min-w-0 { min-width: 0; }
  .max-w-3xl { max-width: 48rem; } .max-w-4xl { max-width: 56rem; } .max-w-page { max-width: 1500px; }
  .shrink-0 { flex-shrink: 0; } .grow { flex-grow: 1; } .list-none { list-style-type: none; }
  .flex-col { flex-direction: column; } .flex-nowrap { flex-wrap: nowrap; }
  .items-baseline { align-items: baseline; } .items-center { align-items: center; } .items-end { align-items: flex-end; }
  .items-start { align-items: flex-start; } .items-stretch { align-items: stretch; }
  .gap-2 { gap: .5rem; } .gap-3 { gap: .75rem; } .gap-4 { gap: 1rem; } .gap-8 { gap: 2rem; } .gap-x-8 { column-gap: 2rem; }
  .overflow-hidden { overflow: hidden; } .rounded-lg { border-radius: .5rem; }
  .p-0 { padding: 0; } .p-4 { padding: 1rem; } .px-4 { padding-inline: 1rem; } .px-8 { padding-inline: 2rem; }
  .px-10 { padding-inline: 2.5rem; } .px-12 { padding-inline: 3rem; }
  .py-05 { padding-block: .125rem; } .py-1 { padding-block: .25rem; } .py-2 { padding-block: .5rem; }
  .py-3 { padding-block: .75rem; } .py-4 { padding-block: 1rem; } .pb-2 { padding-bottom: .5rem; }
  .pl-4 { padding-left: 1rem; } .pl-6 { padding-left: 1.5rem; } .pl-8 { padding-left: 2rem; }
  .text-sm { font-size: .875rem; line-height: calc(1.25 / .875); } .text-base { font-size: 1rem; line-height: 1.5; }
  .text-lg { font-size: 1.125rem; line-height: calc(1.75 / 1.125); } .text-xl { font-size: 1.25rem; line-height: 1.4; }
  .text-2xl { font-size: 1.5rem; line-height: calc(2 / 1.5); } .text-3xl { font-size: 1.875rem; line-height: 1.2; }
  .text-5xl { font-size: 3rem; line-height: 1; } .leading-snug { line-height: 1.375; }
  .font-bold { font-weight: 700; } .font-semibold { font-weight: 600; }
  .break-all { word-break: break-all; } .whitespace-nowrap { white-space: nowrap; }
  .whitespace-pre-line { white-space: pre-line; }
  .text-white { color: #fff; } .no-underline { text-decoration-line: none; }
  .no-underline:hover { text-decoration-line: underline; }
  .grid-cols-1 { grid-template-columns: minmax(0, 1fr); }
  @media (width >= 48rem) { .md-grid-cols-2 { grid-template-columns: repeat(2, minmax(0, 1fr)); } }
  @media (width >= 64rem) { .lg-col-span-2 { grid-column: span 2; }
    .lg-grid-cols-2 { grid-template-columns: repeat(2, minmax(0, 1fr)); }
    .lg-grid-cols-3 { grid-template-columns: repeat(3, minmax(0, 1fr)); } }
  @media (width >= 80rem) { .xl-grid-cols-4 { grid-template-columns: repeat(4, minmax(0, 1fr)); } }
}
  .mb-abort { background: var(--live) !important; color: #fff !important; font-weight: 700; }
  .mb-go { background: var(--act) !important; color: #fff !important; font-weight: 700; }
  .mb-emergency { background: var(--live); color: #fff; font-size: 1.5rem; font-weight: 700; padding: 1rem 1.25rem;
    border-radius: 10px; white-space: pre-line; }
  .mb-card svg[role=img] { display: block; width: 100%; height: auto; }
  .mb-photos { display: flex; flex-wrap: wrap; gap: 1rem; margin-top: .75rem; } .mb-photos:empty { display: none; }
  .mb-photos figure { flex: 0 1 20rem; margin: 0; }
  .mb-number { font-variant-numeric: tabular-nums; }
  .mb-table { border-collapse: collapse; width: 100%; }
  .mb-table th, .mb-table td { text-align: left; padding: .35rem .6rem; border-bottom: 1px solid var(--line); vertical-align: top; }
  .mb-table th { font-weight: 600; color: var(--ink-2); }
  .mb-table td.num, .mb-table th.num { text-align: right; font-variant-numeric: tabular-nums; }
  .mb-table td.num { white-space: nowrap; }
  .mb-table td { word-break: keep-all; overflow-wrap: break-word; }
  .mb-card:has(> .mb-table), .mb-card :has(> .mb-table) { overflow-x: auto; }
  .mb-skip { position: absolute; left: -999px; } .mb-skip:focus { left: 8px; top: 8px; z-index: 9999; background:#fff; padding:.5rem; }
</style>
<link rel="stylesheet" href="/assets/page.css">
<script src="/assets/page.js"></script>
"""


def add_stylesheet() -> None:
    """Add the common style to the page that is being built."""
    ui.add_head_html(_STYLE)
    add_end_style()
