"""The login of a panel that is open to a network: one page without scripts, for whoever is not known yet."""

from string import Template

from nicegui import app
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response

from bench.panel.panel import Panel
from bench.panel.server.access import Access, TooManyTriesError
from bench.panel.server.gate import LOGIN, language_of, session_cookie
from bench.panel.server.sessions import Sessions

#: In both languages: nobody knows yet whose browser it is. What it is filled with are sentences and figures of this file.
_PAGE = Template("""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>motorbench – login</title>
<style>
  body { background: #f4f6f8; color: #17202a; margin: 0;
    font-family: 'Noto Sans','Noto Sans SC','Segoe UI',Arial,'Liberation Sans','DejaVu Sans','Noto Sans CJK SC',sans-serif; }
  main { box-sizing: border-box; width: 24rem; max-width: 100%; margin: 6rem auto 0; padding: 1.5rem; background: #fff;
    border: 1px solid #c9d1d9; border-radius: 10px; }
  h1 { font-size: 1.5rem; margin: 0 0 1rem; }
  form { display: grid; gap: .75rem; }
  input { box-sizing: border-box; width: 100%; min-height: 48px; margin-top: 6px; padding: .5rem; border: 1px solid #6b7884;
    font: inherit; }
  button { min-height: 48px; border: 2px solid #0b4fa0; border-radius: 6px; background: #0b4fa0; color: #fff;
    font: inherit; font-weight: 700; }
  [role=alert] { color: #7a130d; }
  *:focus-visible { outline: 4px solid #ffcf33; box-shadow: 0 0 0 2px #17202a; }
</style></head>
<body><main><h1>motorbench</h1>$alert
<form method="post" action="/login">
<label>Name / 用户名<br><input name="name" autocomplete="username" required autofocus></label>
<label>Password / 密码<br><input name="password" type="password" autocomplete="current-password" required></label>
<button>Log in / 登录</button>
</form></main></body></html>
""")
_WRONG = '<p role="alert">Name or password is wrong. 用户名或密码错误。</p>'
_WAIT = Template(
    '<p role="alert">Too many tries: the next one will be looked at in $wait s. 尝试次数过多：$wait 秒后才能再次尝试。</p>'
)
_NO_STORE = {"cache-control": "no-store"}


def login_page(panel: Panel, access: Access) -> None:
    """Register the login page, and what its form is sent to."""

    @app.get(LOGIN)
    def login(failed: str = "") -> Response:
        return HTMLResponse(_PAGE.substitute(alert=_WRONG if failed else ""), headers=_NO_STORE)

    @app.post(LOGIN)
    async def enter(request: Request) -> Response:
        async with request.form(max_files=0, max_fields=10) as form:
            name, password = str(form.get("name", "")), str(form.get("password", ""))
        try:
            person = await access.check(name, password, request.client.host if request.client else "")
        except TooManyTriesError as error:
            alert = _WAIT.substitute(wait=error.wait)
            headers = {**_NO_STORE, "retry-after": str(error.wait)}
            return HTMLResponse(_PAGE.substitute(alert=alert), 429, headers)
        if person is None:
            return RedirectResponse(f"{LOGIN}?failed=1", status_code=303)
        # A browser has one session: nobody goes on with the one before.
        panel.sessions.end(request.cookies.get(Sessions.COOKIE, ""))
        session = panel.sessions.open(person.role, name, language_of(request.cookies), logged_in=True)
        response = RedirectResponse("/", status_code=303)
        response.headers["set-cookie"] = session_cookie(session, request.scope)
        return response

    @app.post("/logout")
    async def leave(request: Request) -> Response:
        panel.sessions.end(request.cookies.get(Sessions.COOKIE, ""))
        response = RedirectResponse(LOGIN, status_code=303)
        response.delete_cookie(Sessions.COOKIE, httponly=True, samesite="strict")
        return response
