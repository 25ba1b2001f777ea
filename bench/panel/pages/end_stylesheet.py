"""The style of the end of a run: the picture of its parameters, findings, fits."""

from nicegui import ui

_STYLE = """
<style>
  .mb-small { font-size: .875rem; color: #45525f; }
  .mb-state-off { background: var(--safe-bg); border: 3px solid var(--safe); color: var(--safe); }
  .mb-state-unread { background: #fff; border: 3px solid var(--edge); color: var(--ink); }
  .mb-unfinished { background: #fff; border: 3px dashed var(--live); border-radius: .5rem; padding: .75rem 1rem; color: var(--live); }
  .mb-state-live { background: var(--live); border: 3px solid var(--live); color: #fff; }
  .mb-state-live .mb-abort { border: 3px solid #fff; }
  .mb-refused { color: #b3121d; font-size: 1rem; }
  .mb-picture { width: 100%; border-collapse: collapse; table-layout: fixed; }
  .mb-picture th { text-align: left; font-weight: 400; padding: .25rem .5rem; }
  .mb-picture thead th { color: #45525f; vertical-align: bottom; }
  .mb-picture th.num { text-align: right; }
  .mb-picture thead th:nth-child(1) { width: 26%; } .mb-picture thead th:nth-child(2) { width: 22%; }
  .mb-picture td, .mb-picture tbody th { border-top: 1px solid #c5cdd5; padding: .6rem .5rem; vertical-align: middle; }
  .mb-picture td.num { text-align: right; font-variant-numeric: tabular-nums; }
  .mb-quantity-name { font-size: 1.125rem; font-weight: 600; } .mb-value { font-size: 1.25rem; font-weight: 700; }
  .mb-verdict { color: #b3121d; font-weight: 600; font-size: .9rem; }
  .mb-axis-title { text-align: center; } .mb-axis-ticks { position: relative; height: 1.4rem; }
  .mb-picture .mb-axis-cell, .mb-picture th:nth-child(3) { padding-inline: 2rem; }
  .mb-axis-ticks span { position: absolute; transform: translateX(-50%); white-space: nowrap; font-size: .875rem; }
  .mb-axis { position: relative; display: block; height: 2.4rem; border-right: 1px solid #c5cdd5;
    background: linear-gradient(to right, #c5cdd5 1px, transparent 1px) 0 0 / 25% 100%; }
  .mb-axis i { position: absolute; display: block; }
  [data-mark=reference] { top: -.2rem; bottom: -.2rem; width: 2px; margin-left: -1px; background: #17202a; }
  [data-mark=tolerance] { top: 15%; bottom: 15%; background: #e2f3e8; border: 1px dashed #0b5d33; }
  [data-mark=interval] { top: 30%; bottom: 30%; border-left: 3px solid #0b4fa0; border-right: 3px solid #0b4fa0;
    background: linear-gradient(#0b4fa0, #0b4fa0) center / 100% 3px no-repeat; min-width: 3px; }
  [data-mark=dot] { top: 50%; width: 12px; height: 12px; margin: -6px 0 0 -6px; border-radius: 50%; background: #0b4fa0; }
  [data-mark=formula] { top: 50%; width: 13px; height: 13px; margin: -7px 0 0 -7px; transform: rotate(45deg); background: #fff;
    border: 2px solid #855c00; }
  .mb-axis[data-verdict=outside] [data-mark=interval] { border-color: #b3121d; background-image: linear-gradient(#b3121d, #b3121d); }
  .mb-axis[data-verdict=outside] [data-mark=dot] { background: #b3121d; border-radius: 0; }
  .mb-beyond { position: absolute; top: 50%; transform: translateY(-50%); background: #fff; padding: 0 .25rem; font-size: .875rem; }
  .mb-beyond[data-side=right] { right: 14px; } .mb-beyond[data-side=left] { left: 14px; }
  .mb-beyond[data-side=right]::after { content: " ▶"; } .mb-beyond[data-side=left]::before { content: "◀ "; }
  .mb-legend { display: flex; flex-wrap: wrap; gap: .5rem 1rem; align-items: center; margin: .75rem 0; color: #45525f; }
  .mb-legend-key { display: inline-block; width: 3rem; } .mb-sample { height: 1.5rem; border: 0; background: none; }
  .mb-finding { display: flex; gap: .75rem; align-items: center; padding: .6rem .5rem; border-bottom: 1px solid #c5cdd5; }
  [role=heading] + .mb-finding { margin-top: .5rem; }
  .mb-finding[data-rank=missing], .mb-finding[data-rank=contradiction] { background: #fff4cf; }
  .mb-finding-mark { flex: none; width: 1.75rem; height: 1.75rem; line-height: 1.75rem; text-align: center; font-weight: 700;
    border-radius: 50%; border: 2px solid currentcolor; color: #5c3d00; }
  .mb-finding[data-rank=missing] .mb-finding-mark { color: #b3121d; } .mb-finding[data-rank=known] .mb-finding-mark { color: #45525f; }
  .mb-finding .q-btn { flex: none; } .mb-legend > div { display: flex; gap: .5rem; align-items: center; }
  .mb-fits { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(24rem, 100%), 1fr)); gap: 1.25rem; margin-top: .5rem; }
  .mb-fit { margin: 0; min-width: 0; }
  .mb-preview { font-family: 'DejaVu Sans Mono', 'Liberation Mono', monospace; font-size: .875rem; white-space: pre; overflow-x: auto; }
  @media (width <= 43.75rem) {
    .mb-picture thead th:nth-child(-n+2) { display: none; }
    .mb-picture, .mb-picture thead, .mb-picture tbody { display: block; }
    .mb-picture thead th { display: block; width: auto; }
    .mb-picture tr { display: grid; grid-template-columns: minmax(0, 1fr); border-top: 1px solid #c5cdd5; padding: .4rem 0; }
    .mb-picture thead tr { display: block; border: 0; }
    .mb-picture td, .mb-picture tbody th { border: 0; padding: .15rem .5rem; } .mb-picture td.num { text-align: left; }
    .mb-finding { flex-wrap: wrap; } .mb-finding .grow { flex-basis: 70%; }
  }
</style>
"""


def add_end_style() -> None:
    """Add this style to the page that is being built."""
    ui.add_head_html(_STYLE)
