"""Who may use the station: this machine only, unless a token and TLS are asked for.

The page shows a live camera and steers what the pilot sees, so other sites open in the same
browser must not reach it (checked by Host and Origin), nor other machines without the token.
"""

from __future__ import annotations

import datetime
import hmac
import ipaddress
import os
import secrets
import socket
import ssl
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

import ifaddr
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from ..addresses import is_address as is_address
from ..addresses import is_loopback as is_loopback
from ..errors import FreelookError

# Browsers refuse certificates that are valid for longer than 398 days.
VALID = datetime.timedelta(days=397)
RENEW_BEFORE = datetime.timedelta(days=14)


@dataclass(frozen=True)
class Guard:
    """Decides on a request's Host, Origin and token.

    `names` are the host names the station goes by; addresses are always fine, because DNS
    rebinding needs a name. With a token names do not matter: a rebound page does not know it.
    """

    token: str | None = None
    names: frozenset[str] = field(default_factory=frozenset)

    def foreign(self, host: str, origin: str | None) -> str | None:
        """Why a request comes from a foreign place; None when it does not."""
        name = _host_name(host)
        if self.token is None and not is_address(name) and name not in self.names | {"localhost"}:
            return f"the host name {name!r} is not one of this station's; use its address"
        if origin is not None and origin.lower().partition("://")[2] != host.lower():
            return f"requests from the page {origin} are not accepted"
        return None

    def accepts(self, token: str) -> bool:
        return self.token is None or hmac.compare_digest(token.encode(), self.token.encode())


def make_token() -> str:
    return secrets.token_urlsafe(16)


def local_addresses() -> list[str]:
    """This machine's addresses other machines may reach it by: IPv4 first, no link-local ones."""
    found = [ip.ip for adapter in ifaddr.get_adapters() for ip in adapter.ips]
    texts = [text if isinstance(text, str) else text[0] for text in found]
    usable = [ipaddress.ip_address(text) for text in dict.fromkeys(texts)]
    usable = [a for a in usable if not (a.is_loopback or a.is_link_local)]
    return [str(a) for a in sorted(usable, key=lambda a: a.version)]


def tls_context(certificate: Path, key: Path | None) -> ssl.SSLContext:
    """A server's TLS from PEM files; FreelookError says what is wrong with them."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(certificate, key)
    except (OSError, ssl.SSLError) as error:
        files = f"{certificate}" if key is None else f"{certificate} and {key}"
        raise FreelookError(f"cannot use the certificate in {files}: {error}") from None
    return context


def own_certificate(folder: Path, addresses: list[str]) -> tuple[Path, Path]:
    """(certificate, key) files of a self-signed certificate for these addresses and localhost.

    Kept in `folder` and used again, so that a browser has to be told only once; made anew when
    it runs out or an address is missing.
    """
    certificate, key = folder / "certificate.pem", folder / "key.pem"
    if not _still_good(certificate, key, addresses):
        try:
            _write_certificate(certificate, key, addresses)
        except OSError as error:
            raise FreelookError(
                f"cannot keep a certificate in {folder}: {error.strerror}; give one with "
                "--cert and --key"
            ) from None
    return certificate, key


def state_folder() -> Path:
    """Where freelook keeps what must outlive it."""
    base = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(base) / "freelook"


def _still_good(certificate: Path, key: Path, addresses: list[str]) -> bool:
    try:
        found = x509.load_pem_x509_certificate(certificate.read_bytes())
        tls_context(certificate, key)
    except (OSError, ValueError, FreelookError):
        return False
    names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    covered = {str(a) for a in names.get_values_for_type(x509.IPAddress)}
    lasts = found.not_valid_after_utc - RENEW_BEFORE > _utc_now()
    return lasts and covered.issuperset(addresses)


def _write_certificate(certificate: Path, key: Path, addresses: list[str]) -> None:
    private = ec.generate_private_key(ec.SECP256R1())
    made = _self_signed(private, addresses)
    certificate.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    pem = private.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    key.unlink(missing_ok=True)
    with open(os.open(key, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(pem)
    certificate.write_bytes(made.public_bytes(serialization.Encoding.PEM))


def _self_signed(private: ec.EllipticCurvePrivateKey, addresses: list[str]) -> x509.Certificate:
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "freelook station")])
    hosts = [x509.DNSName("localhost"), x509.DNSName(f"{socket.gethostname()}.local")]
    numbers = [x509.IPAddress(ipaddress.ip_address(a)) for a in ["127.0.0.1", *addresses]]
    return (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(private.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(_utc_now() - datetime.timedelta(days=1))
        .not_valid_after(_utc_now() + VALID - datetime.timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName([*hosts, *numbers]), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .sign(private, hashes.SHA256())
    )


def _utc_now() -> datetime.datetime:
    return datetime.datetime.now(datetime.UTC)


def _host_name(host: str) -> str:
    """The name in a Host header, without port and brackets, in lower case."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""
