"""How the report's page looks, and its small script."""

STYLE = """
:root{color-scheme:light;--blend:0}
body{font:16px/1.45 system-ui,"Segoe UI",Helvetica,Arial,sans-serif;color:#1d2733;background:#fff;margin:0}
header,main,footer{max-width:1280px;margin:0 auto;padding:0 1.2rem}
h1{font-size:1.7rem;margin:1.2rem 0 .4rem}h2{font-size:1.3rem;margin:2rem 0 .5rem;border-bottom:1px solid #d5dbe1}
h3{font-size:1.08rem;margin:1.2rem 0 .4rem;overflow-wrap:anywhere}p{margin:.4rem 0;max-width:75em}
.verdict{font-size:1.1rem;font-weight:600;padding:.6rem .9rem;border-left:.5rem solid;border-radius:.2rem}
.good{background:#e6f4ea;border-color:#1f7a3d;color:#14532a}
.caution{background:#fff4d6;border-color:#b07500;color:#5f3f00}
.bad{background:#fde7e5;border-color:#b3261e;color:#7c1610}
.note{padding:.4rem .8rem;border-left:.3rem solid}ul.notes{list-style:none;padding:0}
ul.notes li{margin:.3rem 0;padding:.4rem .8rem;border-left:.3rem solid;
overflow-wrap:anywhere}
.muted{color:#55606c}
.controls{position:sticky;top:0;z-index:1;background:#f4f6f8f2;border-bottom:1px solid #d5dbe1;padding:.5rem 0;
display:flex;flex-wrap:wrap;gap:.3rem 1.4rem;align-items:center}
.controls label{white-space:nowrap}.controls input[type=range]{width:9rem;vertical-align:middle}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,24rem),1fr));gap:1rem}
.closeups{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,22rem),1fr));gap:.8rem}
.charts{display:grid;grid-template-columns:repeat(auto-fill,minmax(15rem,1fr));gap:.8rem}
figure{margin:0}figcaption{font-size:.88rem;color:#3c4854;padding:.2rem 0}
figure svg{display:block;width:100%;background:#000;border-radius:.2rem}
.pair img{width:100%;display:block;border-radius:.2rem}
.closeups svg{aspect-ratio:1;max-height:26rem}
.chart svg{background:#f7f9fa}.chart polyline{fill:none;stroke:#2563a8;stroke-width:1.8}.chart circle{fill:#2563a8}
.chart line{stroke:#c4ccd4;stroke-width:.8}.chart text{font-size:12px;fill:#55606c}
path{fill:none;stroke-width:1.6;vector-effect:non-scaling-stroke;stroke-linejoin:round;pointer-events:stroke;
filter:drop-shadow(0 0 1px #000)}
path.before{stroke:#ff9e3d;stroke-dasharray:5 3}path.after{stroke:#35d6ff}path.flagged{stroke:#ff5c93}
path.anchor{stroke:#ffe066;stroke-width:1.2}
.key b{font-weight:600;background:#2b333b;padding:0 .4em;border-radius:.2em}
.key .before{color:#ff9e3d}.key .after{color:#35d6ff}.key .flagged{color:#ff5c93}.key .anchor{color:#ffe066}
svg text{font-family:inherit}
.names text{fill:#fff;stroke:#000;stroke-width:.18em;paint-order:stroke;text-anchor:middle}
.blend{opacity:var(--blend)}
.no-before path.before,.no-after path.after,.no-anchor path.anchor,.no-names .names{display:none}
.wide{overflow-x:auto}table{border-collapse:collapse;font-size:.92rem}caption{text-align:left;padding:.3rem 0}
th,td{border-bottom:1px solid #d5dbe1;padding:.3rem .6rem;text-align:right;vertical-align:bottom}
th[scope=row],thead th:first-child,td:last-child,thead th:last-child{text-align:left}
td:last-child{min-width:16rem;font-size:.88rem;overflow-wrap:anywhere}thead th{font-weight:600}
th[scope=row]{font-weight:600;overflow-wrap:anywhere;min-width:7rem}
footer{padding:2rem 1.2rem;color:#55606c}
.store{position:absolute;width:0;height:0}
@media print{.controls{display:none}section,figure{break-inside:avoid}}
"""

SCRIPT = """
"use strict";
const bar = document.querySelector(".controls");
bar.hidden = false;
for (const box of bar.querySelectorAll("input[type=checkbox]")) {
  const apply = () => document.body.classList.toggle("no-" + box.name, !box.checked);
  box.addEventListener("change", apply);
  apply();
}
const blend = bar.querySelector("input[type=range]");
const mix = () => document.documentElement.style.setProperty("--blend", blend.value / 100);
blend.addEventListener("input", mix);
mix();
"""
