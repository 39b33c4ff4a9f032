#include "report/page.h"

#include <ctype.h>
#include <stdarg.h>
#include <string.h>

static void put_text(FILE *f, const char *text)
{
    for (; *text; text++) switch (*text) {
        case '&': fputs("&amp;", f); break;
        case '<': fputs("&lt;", f); break;
        case '>': fputs("&gt;", f); break;
        case '"': fputs("&quot;", f); break;
        case '\'': fputs("&#39;", f); break;
        default: fputc((unsigned char)*text < 32 ? ' ' : *text, f);
        }
}

void fs_html_put(FILE *f, const char *markup, ...)
{
    va_list ap;
    va_start(ap, markup);
    for (; *markup; markup++) {
        if (*markup == '@')
            put_text(f, va_arg(ap, const char *));
        else
            fputc(*markup, f);
    }
    va_end(ap);
}

void fs_html_url(FILE *f, const char *path)
{
    for (; *path; path++) {
        unsigned char c = (unsigned char)*path;
        if ((c < 128 && isalnum(c)) || strchr("/._-~", c))
            fputc(c, f);
        else
            fprintf(f, "%%%02X", c);
    }
}

const char fs_html_style[] =
    ":root{color-scheme:dark;--bg:#131416;--card:#1c1e21;--line:#2d3035;--ink:#e8e6e1;--dim:#9a9890;--accent:#f2b44b;"
    "--cool:#6fb1e8}\n"
    "*{box-sizing:border-box}[hidden]{display:none!important}\n"
    "body{margin:0;background:var(--bg);color:var(--ink);font:16px/1.5 system-ui,sans-serif}\n"
    "main{max-width:1180px;margin:0 auto;padding:32px 20px 64px}\n"
    "h1{font-size:30px;margin:0 0 4px;font-weight:650}h2{font-size:20px;margin:44px 0 12px;font-weight:600}\n"
    "p{margin:6px 0;color:var(--dim);max-width:75ch}a{color:var(--cool);text-decoration:none}"
    "a:hover{text-decoration:underline}\n"
    ".chips{display:flex;flex-wrap:wrap;gap:8px;margin:16px 0 28px;padding:0;list-style:none}\n"
    ".chips li{background:var(--card);border:1px solid var(--line);border-radius:99px;padding:3px "
    "14px;font-size:14px}\n"
    ".chips b{font-weight:600;font-variant-numeric:tabular-nums}\n"
    ".warn{background:#33280f;border:1px solid #6d531c;border-radius:10px;padding:12px 18px;margin:0 0 24px}\n"
    ".warn h2{margin:0 0 4px;font-size:16px}.warn ul{margin:0;padding-left:20px}\n"
    ".compare{position:relative;border-radius:10px;overflow:hidden;background:#000;user-select:none;line-height:0}\n"
    ".compare img{width:100%;height:auto;display:block}.compare "
    ".over{position:absolute;inset:0;height:100%;clip-path:inset(0 calc(100% - "
    "var(--at,50%)) 0 0)}\n"
    ".compare .bar{position:absolute;top:0;bottom:0;left:var(--at,50%);width:2px;margin-left:-1px;background:#fff;"
    "pointer-events:none}\n"
    ".compare .bar::after{content:'\\2194';position:absolute;top:50%;left:50%;width:38px;height:38px;margin:-19px;"
    "border-radius:50%;background:#fff;color:#222;font:22px/36px system-ui;text-align:center}\n"
    ".compare input{position:absolute;inset:0;width:100%;height:100%;margin:0;opacity:0;cursor:ew-resize}\n"
    ".compare span{position:absolute;bottom:12px;padding:2px 12px;border-radius:99px;background:#000a;font:14px/24px "
    "system-ui;pointer-events:none}.compare .l{left:12px}.compare .r{right:12px}\n"
    ".buttons{display:flex;flex-wrap:wrap;gap:8px;margin:12px 0}\n"
    "button{font:inherit;color:inherit;background:var(--card);border:1px solid var(--line);border-radius:8px;"
    "padding:5px 14px;cursor:pointer}button[aria-pressed=true]{border-color:var(--accent);color:var(--accent)}\n"
    "button.view{padding:0;overflow:hidden;line-height:0;width:132px}button.view img{width:100%}"
    "button.view span{display:block;font-size:12px;line-height:22px}\n"
    ".grid{display:grid;grid-template-columns:repeat(auto-fill,minmax(300px,1fr));gap:12px}\n"
    ".wide{grid-template-columns:repeat(auto-fit,minmax(340px,1fr))}.span{grid-column:1/-1}\n"
    "figure{margin:0;background:var(--card);border:1px solid var(--line);border-radius:10px;overflow:hidden}\n"
    "figure img,figure video,figure svg{width:100%;display:block}figcaption{padding:6px 12px 8px;font-size:14px;"
    "color:var(--dim)}figcaption b{color:var(--ink);font-weight:600}\n"
    "table{border-collapse:collapse;width:100%;font-size:14px;font-variant-numeric:tabular-nums}"
    "td,th{text-align:left;padding:4px 16px 4px 0;border-bottom:1px solid var(--line);font-weight:400}"
    "th{color:var(--dim)}tr.set td{color:var(--accent)}\n"
    "details{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:10px 18px}"
    "summary{cursor:pointer}code{font:13px ui-monospace,monospace}\n"
    "footer{margin-top:48px;color:var(--dim);font-size:14px}svg text{fill:#9a9890;font:11px system-ui,sans-serif}\n";

// One comparison (photo under the slider, a layer over it), buttons that change its view and its layer.
const char fs_html_script[] =
    "const box=document.querySelector('.compare');\n"
    "if(box){\n"
    " const under=box.querySelector('.under'),over=box.querySelector('.over'),right=box.querySelector('.r');\n"
    " const "
    "views=[...document.querySelectorAll('button.view')],layers=[...document.querySelectorAll('button.layer')];\n"
    " let view=views[0],layer='T';\n"
    " const key=()=>layer=='T'?(view.dataset.flash=='1'?'T_F':'T_N'):layer;\n"
    " const show=()=>{\n"
    "  over.src=view.dataset.base+'photo.jpg';under.src=view.dataset.base+key()+'.jpg';\n"
    "  right.textContent=(layers.find(b=>b.dataset.layer==layer)||{}).textContent||'';\n"
    "  views.forEach(b=>b.setAttribute('aria-pressed',b==view));\n"
    "  layers.forEach(b=>b.setAttribute('aria-pressed',b.dataset.layer==layer));\n"
    "  document.querySelectorAll('.grid.of-view').forEach(g=>g.hidden=g.dataset.base!=view.dataset.base);\n"
    " };\n"
    " views.forEach(b=>b.onclick=()=>{view=b;show()});\n"
    " layers.forEach(b=>b.onclick=()=>{layer=b.dataset.layer;show()});\n"
    " box.querySelector('input').oninput=e=>box.style.setProperty('--at',e.target.value+'%');\n"
    " show();\n"
    "}\n";
