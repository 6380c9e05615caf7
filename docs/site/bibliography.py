"""The page of references, made from docs/references.bib, and links to it wherever a page names its sources by key."""

import re

ENTRY = re.compile(r"@\w+\{(\w+),\n(.*?)\n\}", re.S)
FIELD = re.compile(r"(\w+)\s*=\s*\{(.*?)\},?\s*(?=\n\s*\w+\s*=|\Z)", re.S)
ACCENTS = {
    r"{\"o}": "ö",
    r"{\"a}": "ä",
    r"{\"u}": "ü",
    r"\"o": "ö",
    r"\"a": "ä",
    r"\"u": "ü",
    r"{\^i}": "î",
    r"{\'E}": "É",
    r"\'E": "É",
    r"\'e": "é",
}
ACCENTS |= {r"\'{e}": "é", r"\`e": "è", r"\`{e}": "è", r"\'{a}": "á", r"\'a": "á", r"\&": "&", "--": "–", "~": " ", "\\": ""}


def plain(text):
    """Text without the marks of TeX."""
    for mark, letter in ACCENTS.items():
        text = text.replace(mark, letter)
    return " ".join(text.replace("{", "").replace("}", "").split())


def names(text):
    """Authors as they are printed."""
    people = [" ".join(reversed([part.strip() for part in plain(own).split(",", 1)])) for own in re.split(r"\s+and\s+", text)]
    return people[0] if len(people) == 1 else ", ".join(people[:-1]) + " and " + people[-1]


def entries(bibliography):
    """Key and text of each entry, in the order of the keys."""
    found = {}
    for key, body in ENTRY.findall(bibliography):
        field = dict(FIELD.findall(body))
        where = [
            plain(field[name])
            for name in ("journal", "booktitle", "publisher", "institution", "organization", "howpublished")
            if name in field
        ]
        if "volume" in field:
            where[:1] = [f"{where[0]} {plain(field['volume'])}"] if where else [plain(field["volume"])]
        parts = [
            names(field.get("author", field.get("organization", ""))),
            f"*{plain(field.get('title', ''))}*",
            *where,
            plain(field.get("pages", "")),
        ]
        text = ", ".join(part for part in parts if part) + f" ({field.get('year', '')})."
        if "doi" in field:
            text += f" [doi:{field['doi']}](https://doi.org/{field['doi']})"
        found[key] = text
    return dict(sorted(found.items()))


def page(bibliography):
    """The page."""
    return "".join(f"\n({key})=\n{key}\n: {text}\n" for key, text in entries(bibliography).items())


def linked(line, bibliography):
    """A line of sources with links in place of the keys."""
    return re.sub(r"\b[a-z]+(?:19|20)\d\d\b", lambda key: f"[{key[0]}](#{key[0]})" if f"{{{key[0]}," in bibliography else key[0], line)
