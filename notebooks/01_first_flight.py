import marimo

app = marimo.App()
if __name__ == "__main__":
    app.run()
