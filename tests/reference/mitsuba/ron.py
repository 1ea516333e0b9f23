"""Reads the subset of RON that scene files use.

A named struct becomes (name, dict), an unnamed one a dict, a tuple a list, a bare word (name, {}).
A struct with unnamed fields, like RotateY(15), becomes (name, [values]).
"""
import re

TOKEN = re.compile(r'\s*(?:(//[^\n]*)|("(?:[^"\\]|\\.)*")|([-+]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)|([A-Za-z_]\w*)|([()\[\]{}:,]))')


def tokens(text):
    place, found = 0, []
    text = text.rstrip()
    while place < len(text):
        match = TOKEN.match(text, place)
        if not match:
            raise ValueError(f"line {text.count(chr(10), 0, place) + 1}: {text[place:place + 30]!r}")
        place = match.end()
        comment, string, number, word, mark = match.groups()
        if comment is None:
            found.append(("s", string[1:-1]) if string is not None else ("n", float(number)) if number is not None
                         else ("w", word) if word is not None else ("m", mark))
    return found


class Parser:
    def __init__(self, text):
        self.tokens, self.place = tokens(text), 0

    def peek(self, ahead=0):
        return self.tokens[self.place + ahead] if self.place + ahead < len(self.tokens) else (None, None)

    def take(self, mark=None):
        token = self.peek()
        if mark is not None and token != ("m", mark):
            raise ValueError(f"{mark!r} expected, found {token}")
        self.place += 1
        return token

    def value(self):
        kind, value = self.peek()
        if kind in ("s", "n"):
            self.take()
            return value
        if kind == "w":
            self.take()
            if value in ("true", "false"):
                return value == "true"
            if self.peek() == ("m", "("):
                return (value, self.fields())
            return (value, {})
        if value == "(":
            return self.fields()
        if value == "[":
            self.take()
            items = []
            while self.peek() != ("m", "]"):
                items.append(self.value())
                if self.peek() == ("m", ","):
                    self.take()
            self.take("]")
            return items
        if value == "{":
            self.take()
            items = {}
            while self.peek() != ("m", "}"):
                key = self.value()
                self.take(":")
                items[key] = self.value()
                if self.peek() == ("m", ","):
                    self.take()
            self.take("}")
            return items
        raise ValueError(f"a value expected, found {kind} {value}")

    def fields(self):
        self.take("(")
        named = self.peek()[0] == "w" and self.peek(1) == ("m", ":")
        result = {} if named else []
        while self.peek() != ("m", ")"):
            if named:
                key = self.take()[1]
                self.take(":")
                if key in result:
                    raise ValueError(f"{key} stands twice")
                result[key] = self.value()
            else:
                result.append(self.value())
            if self.peek() == ("m", ","):
                self.take()
        self.take(")")
        return result


def parse(text):
    parser = Parser(text)
    name, scene = parser.value()
    if name != "Scene" or parser.peek()[0] is not None:
        raise ValueError("one Scene(...) expected")
    return scene
