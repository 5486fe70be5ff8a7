"""The local web page that shows a result: what it shows, how it is drawn, and how it is served."""
