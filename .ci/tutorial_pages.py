"""What a reader of a tutorial does, taken from the page word for word. Used by .ci/fresh_reader and by tests."""
import re

WRITE = re.compile(r"(?:Write this to|Save this as) `([\w.]+)`")
COMMAND = re.compile(r"(?:ros\w+|\./run|\./test|export|source|mkdir|cd|sleep|(?:/usr/bin/)?python3) ")
SAYS = re.compile(r"\b(?:[Pp]rints|[Ss]ays|[Aa]nswers) `([^`]+)`")


def steps(text):
    """("file", name, text), ("command", line, line number) and ("says", words, line number), in order. Blocks of code that are
    neither a file nor begin with a program that a reader starts show what a program prints."""
    lines, found, k = text.splitlines(), [], 0
    while k < len(lines):
        name = WRITE.search(lines[k])
        if name:
            begin = next(i for i in range(k + 1, len(lines)) if lines[i].startswith(("```", "    ")))
            if lines[begin].startswith("```"):
                k = lines.index("```", begin + 1)
                body = lines[begin + 1:k]
            else:
                k = next(i for i in range(begin, len(lines) + 1) if i == len(lines) or not lines[i].startswith("    ")) - 1
                body = [line[4:] for line in lines[begin:k + 1]]
            found.append(("file", name[1], "\n".join(body) + "\n"))
        elif lines[k].startswith("```"):
            k = lines.index("```", k + 1)
        elif lines[k].startswith("    "):
            if COMMAND.match(lines[k].strip()):
                found.append(("command", re.sub(r"\s{2,}#.*", "", lines[k].strip()), k + 1))
        else:
            found += [("says", words, k + 1) for words in SAYS.findall(lines[k])]
        k += 1
    return found
