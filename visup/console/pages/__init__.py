"""What is seen in the browser: the list of runs, and the page of one run.

Pages are laid out with NiceGUI, which keeps each page's elements on the server; what they show comes from
`visup.console` alone.
"""
