"""The login of a panel that is open to a network."""

from nicegui import ui
from starlette.requests import Request
from starlette.responses import RedirectResponse

from bench.panel.access import Access
from bench.panel.panel import Panel
from bench.panel.sessions import Sessions


def login_page(panel: Panel, access: Access) -> None:
    """Register the login page, and what its form is sent to."""
    from nicegui import app

    @ui.page("/login")
    def login(failed: str = "") -> None:
        ui.page_title("motorbench – login")
        with ui.element("main").classes("w-96 mx-auto mt-24 p-6 border rounded-lg bg-white"):
            ui.label("motorbench").classes("text-2xl font-bold mb-4")
            if failed:
                ui.label("Name or password is wrong. 用户名或密码错误。").props("role=alert").classes(
                    "text-red-800 mb-2"
                )
            # A plain form: browsers offer to keep the password, and the cookie comes with the answer.
            ui.html(
                '<form method="post" action="/login" style="display:grid;gap:.75rem">'
                '<label>Name / 用户名<br><input name="name" autocomplete="username" required autofocus '
                'style="border:1px solid #888;padding:.5rem;width:100%"></label>'
                '<label>Password / 密码<br><input name="password" type="password" autocomplete="current-password" required '
                'style="border:1px solid #888;padding:.5rem;width:100%"></label>'
                '<button style="background:#17202a;color:#fff;padding:.6rem;border-radius:6px">Log in / 登录</button></form>',
                sanitize=False,
            )

    @app.post("/login")
    async def enter(request: Request) -> RedirectResponse:
        form = await request.form()
        name = str(form.get("name", ""))
        person = await access.check(name, str(form.get("password", "")))
        if person is None:
            return RedirectResponse("/login?failed=1", status_code=303)
        language = "zh" if request.cookies.get("motorbench_language") == "zh" else "en"
        session = panel.sessions.open(person.role, name, language)
        response = RedirectResponse("/", status_code=303)
        response.set_cookie(Sessions.COOKIE, session.token, httponly=True, samesite="strict")
        return response

    @app.post("/logout")
    async def leave(request: Request) -> RedirectResponse:
        token = request.cookies.get(Sessions.COOKIE, "")
        panel.control.release(token)
        panel.sessions.end(token)
        return RedirectResponse("/login", status_code=303)
