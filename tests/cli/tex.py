"""What LaTeX asks of a file of tables."""
import re


def check_tex(test, text):
    """What LaTeX asks for: one number of columns a table, braces in pairs, no sign of its own that was meant as text,
    and fewer than some fifty tables until pages are made."""
    text = re.sub(r"(?m)(?<!\\)%.*$", "", text)
    depth = 0
    for sign in re.findall(r"(?<!\\)[{}]", text):
        depth += 1 if sign == "{" else -1
        test.assertGreaterEqual(depth, 0)
    test.assertEqual(depth, 0)
    test.assertNotRegex(re.sub(r"\$[TRI](_[NF])?\$", "", text), r"(?<!\\)[$_#^~]")
    for between in text.split("\\clearpage"):
        test.assertLess(between.count("\\begin{table}"), 30)
    tables = re.findall(r"\\begin{tabular}{([^\n]*)}\n(.*?)\\end{tabular}", text, re.S)
    test.assertEqual(len(tables), text.count("\\begin{table}"))
    for columns, body in tables:
        for line in body.splitlines():
            if not re.fullmatch(r"\\(top|mid|bottom)rule", line):
                test.assertEqual(len(re.findall(r"(?<!\\)&", line)), len(re.sub(r"p{.*?}", "p", columns)) - 1, line)
                test.assertTrue(line.endswith(r" \\"), line)
