"""One request to a URL, of which only the success counts."""

import http.client
import urllib.error
import urllib.request

from rigwatch.wire.errors import reason_of


def why_not(url: str, timeout: float) -> str:
    """Why the URL does not answer with success; "" if it does.

    Args:
        url: http or https; a redirection to any other scheme is refused.
        timeout: longest wait for each part of the answer [s].
    """
    try:
        with _opener().open(url, timeout=timeout):
            return ""
    except urllib.error.HTTPError as error:
        error.close()
        return f"the server answers {error.code}"
    except urllib.error.URLError as error:
        reason = error.reason
        return reason_of(reason) if isinstance(reason, OSError) else str(reason)
    except (ValueError, http.client.InvalidURL):
        return "the address is not valid"
    except http.client.HTTPException:
        return "the answer is not HTTP"
    except OSError as error:
        return reason_of(error)


def _opener() -> urllib.request.OpenerDirector:
    opener = urllib.request.OpenerDirector()
    for handler in (
        urllib.request.ProxyHandler(),
        urllib.request.HTTPHandler(),
        urllib.request.HTTPSHandler(),
        urllib.request.HTTPDefaultErrorHandler(),
        urllib.request.HTTPRedirectHandler(),
        urllib.request.HTTPErrorProcessor(),
    ):
        opener.add_handler(handler)
    return opener
